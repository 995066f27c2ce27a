"""Short slips: moments in which the wheels turn otherwise than the IMU moves along the floor.

A slip lasts a few tenths of a second, which a block of `stretches` averages away. The
vertical axis distinguishes it from a bump, which shakes that more than the horizontal one. What a
large tilt leaves is the error of the equations for small angles, up to a limit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..recording import FloatArray
from ..robot import Robot
from ..samples import STANDARD_GRAVITY
from .evidence import BoolArray
from .finding import Finding, Severity
from .rows import EVERY, Rows, predicted

WINDOW = 0.4
"""Signals are compared over this time [s]."""
CONTRADICTING = 0.2
"""A window contradicts if this share of its largest signal is left."""
LEAST_LEFT = 0.12
"""Less than this is no slip [m/s^2]."""
ABOVE_NOISE = 2.0
"""And less than this many times the noise of the wheels' readings is none."""
ABOVE_USUAL = 5.0
"""And less than this many times what the windows leave usually is none."""
SHAKEN = 1.3
"""With a vertical acceleration this many times larger than what is left, it is a bump."""
STEEP = 2.0
"""A large tilt may leave this many times the first terms that small angles leave out."""
NAMED = 3
"""Slips whose time is named."""


def slips(
    rows: Rows, robot: Robot, noise: float = 0.0, strictness: float = 1.0
) -> Iterator[Finding]:
    """Yield when the wheels slip for a moment; wheels and IMU agree in the whole.

    Args:
        rows: the motion, without clipped readings.
        robot: as configured.
        noise: of the wheels' readings as acceleration [m/s^2].
        strictness: factor of all limits, above 1 for a robot that is handled a lot.
    """
    begins, sliding = _sliding(rows, robot, noise, strictness)
    if not sliding.any():
        return
    times = begins[sliding]
    first = times[np.append(True, np.diff(times) > WINDOW)]
    named = ", ".join(f"{time:.1f} s" for time in first[:NAMED])
    more = f" and {first.size - NAMED} more times" if first.size > NAMED else ""
    lasting = EVERY * times.size + (WINDOW - EVERY) * first.size
    text = (
        f"they turn otherwise than the IMU moves at {named}{more}, for {lasting:.1f} s in all: the "
        "wheels slip (ice, dust, a smooth floor), or the robot falls or hits something; the tilt "
        "is worse there"
    )
    yield Finding(Severity.WARN, "wheels", "slip", text, float(sliding.mean()))


def _sliding(
    rows: Rows, robot: Robot, noise: float, strictness: float
) -> tuple[FloatArray, BoolArray]:
    """Return the begin of each window [s], and whether the wheels slip in it."""
    count = round(WINDOW / EVERY)
    if rows.time.size < count:
        return np.empty(0), np.empty(0, dtype=np.bool_)
    force = rows.force[:, 0]
    gyro, wheels = predicted(rows, robot)
    tilt = np.abs(rows.turn[:, 1])
    steep = np.abs(wheels) * tilt**2 / 2.0 + STANDARD_GRAVITY * tilt**3 / 6.0
    left = _size(force - gyro - wheels, count)
    shown = np.max([_size(each, count) for each in (force, gyro, wheels)], axis=0)
    whole = rows.time[count - 1 :] - rows.time[: 1 - count] < WINDOW
    usual = float(np.median(left[whole])) if whole.any() else 0.0
    floor = max(LEAST_LEFT, ABOVE_NOISE * noise, ABOVE_USUAL * usual) + STEEP * _size(steep, count)
    sliding = whole & (left > strictness * np.maximum(CONTRADICTING * shown, floor))
    sliding &= _size(rows.force[:, 2], count) < SHAKEN * left
    return rows.time[: 1 - count], sliding


def _size(values: FloatArray, count: int) -> FloatArray:
    """Return the root mean square of each window of so many rows."""
    total = np.concatenate([[0.0], np.cumsum(np.square(values))])
    size: FloatArray = np.sqrt(np.maximum(total[count:] - total[:-count], 0.0) / count)
    return size
