"""Offsets between the clocks of two streams, from the motion that both show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..recording import FloatArray
from ..robot import Robot
from ..samples import STANDARD_GRAVITY
from .band import banded, clear_of_ends
from .causes import Cause
from .evidence import Part
from .rows import DELAY_SHARE, LEAST_SHARE, LONGEST_DELAY, on_body, spread

ALIKE = 1.2
"""Misfits that differ by less than this factor are alike."""


def wheel_delay(parts: Sequence[Part], robot: Robot) -> Cause:
    """Return how much later than stamped the wheels must be read to agree with the IMU [s]."""
    pairs = [
        (_wanted(part, robot), _rolled(part, robot), part.step)
        for part in parts
        if part.wheels is not None and np.isfinite(part.wheels).all(axis=1).mean() > LEAST_SHARE
    ]
    size = min((_smaller(wanted, rolled, step) for wanted, rolled, step in pairs), default=1.0)
    return _best("wheel clock", pairs)._replace(size=size)


def reference_delay(parts: Sequence[Part]) -> Cause:
    """Return how much later than stamped the reference must be read to agree with the gyro [s]."""
    pairs = [
        (banded(part.turn[:, 1], part.step), banded(part.reference, part.step), part.step)
        for part in parts
        if part.reference is not None and np.isfinite(part.reference).mean() > LEAST_SHARE
    ]
    return _best("reference clock", pairs)


def _smaller(wanted: FloatArray, rolled: FloatArray, step: float) -> float:
    """Return the size of the smaller of two signals [m/s^2]."""
    inside = clear_of_ends(wanted.size, step)
    known = np.isfinite(wanted[inside] + rolled[inside])
    return min(spread(each[inside][known]) for each in (wanted, rolled))


def _wanted(part: Part, robot: Robot) -> FloatArray:
    """Return what the wheels must add to the force by gyro and accelerometer [m/s^2], (n,)."""
    height = robot.lever_arm[2] + on_body(robot) * robot.wheel_radius
    tilt = part.turn[:, 1]
    gyro = -STANDARD_GRAVITY * banded(tilt, part.step) + height * banded(tilt, part.step, 2)
    wanted: FloatArray = banded(part.push[:, 0], part.step, 1) - gyro
    return wanted


def _rolled(part: Part, robot: Robot) -> FloatArray:
    assert part.wheels is not None
    rolled: FloatArray = robot.wheel_radius * banded(part.wheels.mean(axis=1), part.step, 2)
    return rolled


def _best(name: str, pairs: Sequence[tuple[FloatArray, FloatArray, float]]) -> Cause:
    """Return the shift of the second signals with the smallest misfit, refined by a parabola."""
    if not pairs:
        return Cause(name, 0.0, np.inf, np.inf)
    step = pairs[0][2]
    longest = max(wanted.size for wanted, _, _ in pairs)
    reach = min(round(LONGEST_DELAY / step), int(DELAY_SHARE * longest))
    shifts = np.arange(-reach, reach + 1)
    misfits = np.array([_misfit(pairs, int(shift), reach) for shift in shifts])
    best = _nearest_minimum(misfits)
    if best is None:
        return Cause(name, 0.0, np.inf, np.inf)
    left, middle, right = np.square(misfits[best - 1 : best + 2])
    bend = left - 2.0 * middle + right
    fraction = 0.5 * (left - right) / bend if bend > 0.0 else 0.0
    return Cause(name, float(shifts[best] + fraction) * step, step, float(misfits[best]))


def _nearest_minimum(misfits: FloatArray) -> int | None:
    """Return where, nearest to the middle, a local minimum is about as deep as the deepest.

    A motion that repeats fits shifted by its period nearly as well.
    """
    inner = misfits[1:-1]
    low = (inner <= misfits[:-2]) & (inner <= misfits[2:]) & (inner <= ALIKE * misfits.min())
    found = 1 + np.flatnonzero(low & np.isfinite(inner))
    if not found.size or misfits[found].min() > misfits.min():
        return None
    return int(found[np.argmin(np.abs(found - misfits.size // 2))])


def _misfit(pairs: Sequence[tuple[FloatArray, FloatArray, float]], shift: int, reach: int) -> float:
    differences = []
    for wanted, moved, step in pairs:
        inside = clear_of_ends(wanted.size, step)
        begin, end = inside.start + reach, inside.stop - reach
        if end > begin:
            differences.append(wanted[begin:end] - moved[begin + shift : end + shift])
    values = np.concatenate(differences) if differences else np.empty(0)
    values = values[np.isfinite(values)]
    return spread(values) if values.size else np.inf
