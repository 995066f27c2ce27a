"""Single causes that could make wheels and IMU contradict each other, each with its ratio.

Every cause is a regression with one unknown: the factor by which one signal, or one length, is
wrong while all else is right. The cause that leaves least is the likeliest. A balancing robot
moves in a way that ties tilt and acceleration together, so several unknowns at once could
not be told apart; one can.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..calibration.regression import regress
from ..recording import FloatArray
from ..robot import EncoderPlacement, Robot
from ..samples import STANDARD_GRAVITY
from .rows import Rows, on_body, predicted, spread

LARGEST_ERROR = 0.3
"""Largest standard error of a ratio, as a share of it."""


class Cause(NamedTuple):
    """One explanation of the data."""

    name: str
    ratio: float
    """Factor that makes the data agree; 1 where they do."""
    error: float
    """Standard error of the ratio."""
    misfit: float
    """What it leaves, robust standard deviation [m/s^2]."""

    @property
    def believable(self) -> bool:
        """Whether the ratio is known well enough to be one."""
        return self.ratio != 0.0 and self.error < LARGEST_ERROR * abs(self.ratio)


def as_configured(rows: Rows, robot: Robot) -> float:
    """Return what the configuration leaves, robust standard deviation [m/s^2]."""
    gyro, wheels = predicted(rows, robot)
    return spread(rows.force[:, 0] - gyro - wheels)


def causes(rows: Rows, robot: Robot) -> Iterator[Cause]:
    """Yield every cause that the rows can tell."""
    force, blocks = rows.force[:, 0], rows.blocks
    gyro, wheels = predicted(rows, robot)
    yield _cause("gyro", force - wheels, gyro, blocks)
    yield _scaled_force("accelerometer", force, gyro + wheels, blocks)
    yield from _other_axes(rows, robot, wheels)
    if rows.wheels is not None:
        yield _cause("wheels", force - gyro, wheels, blocks)
        yield from _lengths(rows, robot)
        yield _other_placement(rows, robot)
        if rows.wheels.shape[1] == 2:
            yield from _single_wheels(rows, robot, gyro)


def _cause(name: str, target: FloatArray, term: FloatArray, blocks: FloatArray) -> Cause:
    if not np.any(term):
        return Cause(name, 0.0, np.inf, np.inf)
    fit = regress(term[:, None], target, blocks)
    return Cause(name, float(fit.values[0]), float(fit.errors[0]), fit.deviation)


def _scaled_force(name: str, force: FloatArray, wanted: FloatArray, blocks: FloatArray) -> Cause:
    """Return the factor on the accelerometer; its misfit counts in true units, as all others."""
    fit = _cause(name, force, wanted, blocks)
    if fit.ratio == 0.0:
        return Cause(name, 0.0, np.inf, np.inf)
    scale = 1.0 / fit.ratio
    return Cause(name, scale, fit.error * scale**2, fit.misfit * abs(scale))


def _other_axes(rows: Rows, robot: Robot, wheels: FloatArray) -> Iterator[Cause]:
    """Yield the gyro's and the accelerometer's other axes in the place of the right ones."""
    force, blocks = rows.force[:, 0], rows.blocks
    for axis, name in ((0, "x"), (2, "z")):
        gyro, _ = predicted(rows, robot, axis)
        yield _cause(f"gyro axis {name}", force - wheels, gyro, blocks)
    gyro, _ = predicted(rows, robot)
    for axis, name in ((1, "y"), (2, "z")):
        wanted = gyro + wheels
        yield _scaled_force(f"accelerometer axis {name}", rows.force[:, axis], wanted, blocks)


def _lengths(rows: Rows, robot: Robot) -> Iterator[Cause]:
    force, blocks, placed = rows.force[:, 0], rows.blocks, on_body(robot)
    assert rows.wheels is not None
    turning = rows.turning[:, 1]
    gravity = -STANDARD_GRAVITY * rows.turn[:, 1]
    rolled = robot.wheel_radius * (rows.wheels.mean(axis=1) + placed * turning)
    lifted = robot.lever_arm[2] * turning
    yield _cause("wheel radius", force - gravity - lifted, rolled, blocks)
    arm = _cause("lever arm", force - gravity - rolled, turning, blocks)
    yield arm  # its ratio is a length [m], since the configured one may be 0


def _other_placement(rows: Rows, robot: Robot) -> Cause:
    placed = robot.encoder_placement is EncoderPlacement.BODY
    other = EncoderPlacement.GROUND if placed else EncoderPlacement.BODY
    assert rows.wheels is not None
    gravity = -STANDARD_GRAVITY * rows.turn[:, 1]
    turning = rows.turning[:, 1]
    body = 0.0 if placed else 1.0
    rolled = robot.wheel_radius * (rows.wheels.mean(axis=1) + body * turning)
    wanted = gravity + rolled + robot.lever_arm[2] * turning
    return Cause(other.value, 1.0, 0.0, spread(rows.force[:, 0] - wanted))


def _single_wheels(rows: Rows, robot: Robot, gyro: FloatArray) -> Iterator[Cause]:
    """Yield one wheel counted backward, and one wheel that shows nothing."""
    assert rows.wheels is not None
    left, right = robot.wheel_radius * rows.wheels.T
    target = rows.force[:, 0] - gyro
    for name, other, own in (("left wheel", right, left), ("right wheel", left, right)):
        yield Cause(f"{name} reversed", -1.0, 0.0, spread(target - 0.5 * (other - own)))
        yield Cause(f"{name} wrong", 0.0, 0.0, spread(target - other))
