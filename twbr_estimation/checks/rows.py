"""What every check of motion compares: the same band of all signals, part after part.

With the small tilt phi, the encoder angle theta, wheel radius r, height z of the IMU, and
b = 1 for an encoder on the body, else 0, the forward specific force is (Laddach 2022 (13)-(21))

    force = -g phi + r (theta'' + b phi'') + z phi''.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray
from ..robot import EncoderPlacement, Robot
from ..samples import STANDARD_GRAVITY
from .band import SHORT, banded, clear_of_ends
from .evidence import Part

LONGEST_DELAY = 5.0
"""Offsets of clocks are looked for up to this [s], and up to `DELAY_SHARE` of the longest part."""
DELAY_SHARE = 0.16
LEAST_SHARE = 0.3
"""Wheels, or a reference, known for a smaller share of the time are not compared."""
BLOCK = 2.0
"""Residuals this far apart [s] count as independent."""
_NORMAL_MAD = 1.4826
EVERY = 0.04
"""Time between rows [s]."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Signals in the band at n instants."""

    force: FloatArray
    """Specific force along x, y, z [m/s^2], (n, 3)."""
    turn: FloatArray
    """Angle turned about x, y, z [rad], (n, 3)."""
    turning: FloatArray
    """Its second derivative [rad/s^2], (n, 3)."""
    rate: FloatArray
    """Its first derivative [rad/s], (n, 3)."""
    wheels: FloatArray | None
    """Second derivative of the encoder angles [rad/s^2], (n, w)."""
    wheel_rates: FloatArray | None
    """First derivative of the encoder angles [rad/s], (n, w)."""
    reference: FloatArray | None
    """Reference tilt and its second derivative, (n, 2)."""
    blocks: FloatArray
    """Number of the block each row belongs to, (n,)."""
    time: FloatArray
    """Time since the recording's first IMU reading [s], (n,)."""


def rows_of(parts: Sequence[Part], delay: float = 0.0) -> Rows | None:
    """Return the rows of all parts; None where they are too short.

    Args:
        parts: the data.
        delay: the wheels are read this much later than the IMU [s].
    """
    found = [_rows(part, delay, 1e6 * index) for index, part in enumerate(parts)]
    kept = [each for each in found if each.blocks.size]
    if not kept:
        return None
    columns = {name: _stacked([getattr(each, name) for each in kept]) for name in Rows.__slots__}
    return Rows(**columns)  # type: ignore[arg-type]


def _stacked(columns: list[FloatArray | None]) -> FloatArray | None:
    present = [each for each in columns if each is not None]
    return np.concatenate(present) if len(present) == len(columns) else None


def _rows(part: Part, delay: float, first_block: float) -> Rows:
    chosen = _chosen(part)

    def at(values: FloatArray, order: int) -> FloatArray:
        columns = values.T if values.ndim == 2 else values[None]
        return np.column_stack([banded(column, part.step, order)[chosen] for column in columns])

    wheels, tilt = _later(part, delay), _known(part.reference)
    columns = {
        "force": at(part.push, 1),
        "turn": at(part.turn, 0),
        "turning": at(part.turn, 2),
        "rate": at(part.turn, 1),
        "wheels": None if wheels is None else at(wheels, 2),
        "wheel_rates": None if wheels is None else at(wheels, 1),
        "reference": None if tilt is None else np.hstack([at(tilt, 0), at(tilt, 2)]),
        "blocks": (first_block + np.floor(part.time[chosen] / BLOCK))[:, None],
        "time": part.time[chosen][:, None],
    }
    present = [each for each in columns.values() if each is not None]
    whole = np.isfinite(np.hstack(present)).all(axis=1)
    kept = {name: None if each is None else each[whole] for name, each in columns.items()}
    single = {
        name: each[:, 0] for name in ("blocks", "time") if (each := kept.pop(name)) is not None
    }
    return Rows(**kept, **single)  # type: ignore[arg-type]


def _known(reference: FloatArray | None) -> FloatArray | None:
    """Return the reference; None where it is known hardly anywhere."""
    if reference is None or np.isfinite(reference).mean() < LEAST_SHARE:
        return None
    return reference


def _later(part: Part, delay: float) -> FloatArray | None:
    """Return the wheels as they read `delay` later; None where there are hardly any."""
    wheels = part.wheels
    if wheels is None or np.isfinite(wheels).all(axis=1).mean() < LEAST_SHARE:
        return None
    if delay == 0.0:
        return wheels
    later = part.time + delay
    return np.column_stack([np.interp(later, part.time, column) for column in wheels.T])


def _chosen(part: Part) -> NDArray[np.int64]:
    """Return the indices of the rows, away from the ends and from clipping."""
    every = max(round(EVERY / part.step), 1)
    inside = np.arange(part.time.size)[clear_of_ends(part.time.size, part.step)]
    reach = np.ones(2 * round(3.0 * SHORT / part.step) + 1)
    usable = np.convolve(~part.usable, reach, "same") < 0.5
    chosen = inside[::every]
    return np.asarray(chosen[usable[chosen]], dtype=np.int64)


def on_body(robot: Robot) -> float:
    """Return 1 for an encoder on the body, 0 for one referred to ground."""
    return 1.0 if robot.encoder_placement is EncoderPlacement.BODY else 0.0


def predicted(rows: Rows, robot: Robot, gyro_axis: int = 1) -> tuple[FloatArray, FloatArray]:
    """Return the forward force that the gyro predicts and that the wheels add, (n,) each."""
    height = robot.lever_arm[2] + on_body(robot) * robot.wheel_radius
    gyro = -STANDARD_GRAVITY * rows.turn[:, gyro_axis] + height * rows.turning[:, gyro_axis]
    if rows.wheels is None:
        return gyro, np.zeros_like(gyro)
    return gyro, robot.wheel_radius * rows.wheels.mean(axis=1)


def spread(values: FloatArray) -> float:
    """Return the robust standard deviation of `values` around 0."""
    return _NORMAL_MAD * float(np.median(np.abs(values))) if values.size else 0.0
