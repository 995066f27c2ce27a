"""Single causes that could make wheels and IMU contradict each other, each with its ratio.

Every cause is a regression with one unknown: the factor by which one signal, or one length, is
wrong while all else is right. The cause that leaves least is the likeliest. A balancing robot
moves in a way that ties tilt and acceleration together, so several unknowns at once could
not be separated; one can.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
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
    size: float = 1.0
    """Size of the signals that cancel if it is right [m/s^2]."""

    def left(self, most: float = math.inf) -> float:
        """Return what it leaves as a share of the signals.

        A factor that makes every signal small explains a contradiction only seemingly.

        Args:
            most: size of the largest signal as configured [m/s^2]; a cause gains nothing by
                making signals larger.
        """
        size = min(self.size, most)
        return self.misfit / size if size > 0.0 else math.inf

    @property
    def believable(self) -> bool:
        """Whether the ratio is known well enough to be one."""
        return self.ratio != 0.0 and self.error < LARGEST_ERROR * abs(self.ratio)


def as_configured(rows: Rows, robot: Robot) -> Cause:
    """Return what the configuration leaves."""
    gyro, wheels = predicted(rows, robot)
    return _exact("as configured", rows.force[:, 0], gyro, wheels)


def largest_signal(rows: Rows, robot: Robot) -> float:
    """Return the size of the largest signal as configured [m/s^2]."""
    return max(spread(each) for each in (rows.force[:, 0], *predicted(rows, robot)))


def causes(rows: Rows, robot: Robot) -> Iterator[Cause]:
    """Yield every cause that the rows can determine."""
    force = rows.force[:, 0]
    gyro, wheels = predicted(rows, robot)
    yield _scaled("gyro", rows, force, gyro, wheels)
    yield _scaled_force("accelerometer", rows, force, gyro, wheels)
    yield from _other_axes(rows, robot, wheels)
    yield from _turned(rows, robot)
    if rows.wheels is not None:
        yield _scaled("wheels", rows, force, wheels, gyro)
        yield from _lengths(rows, robot)
        yield _other_placement(rows, robot)
        if rows.wheels.shape[1] == 2:
            yield from _single_wheels(rows, robot, gyro)


def _size(force: FloatArray, gyro: FloatArray, wheels: FloatArray) -> float:
    """Return the size of signals of which force = gyro + wheels [m/s^2]."""
    return max(spread(force), min(spread(gyro), spread(wheels)))


def _exact(
    name: str, force: FloatArray, gyro: FloatArray, wheels: FloatArray, ratio: float = 1.0
) -> Cause:
    """Return a cause without an unknown."""
    return Cause(name, ratio, 0.0, spread(force - gyro - wheels), _size(force, gyro, wheels))


def _scaled(
    name: str, rows: Rows, force: FloatArray, term: FloatArray, others: FloatArray
) -> Cause:
    """Return the factor on one term where the others are right."""
    if not np.any(term):
        return Cause(name, 0.0, np.inf, np.inf)
    fit = regress(term[:, None], force - others, rows.blocks)
    ratio = float(fit.values[0])
    size = _size(force, ratio * term, others)
    return Cause(name, ratio, float(fit.errors[0]), fit.deviation, size)


def _scaled_force(
    name: str, rows: Rows, force: FloatArray, gyro: FloatArray, wheels: FloatArray
) -> Cause:
    """Return the factor on the accelerometer; its misfit counts in true units, as all others."""
    wanted = gyro + wheels
    if not np.any(wanted):
        return Cause(name, 0.0, np.inf, np.inf)
    fit = regress(wanted[:, None], force, rows.blocks)
    if fit.values[0] == 0.0:
        return Cause(name, 0.0, np.inf, np.inf)
    scale = 1.0 / float(fit.values[0])
    size = _size(scale * force, gyro, wheels)
    error = float(fit.errors[0]) * scale**2
    return Cause(name, scale, error, fit.deviation * abs(scale), size)


def _other_axes(rows: Rows, robot: Robot, wheels: FloatArray) -> Iterator[Cause]:
    """Yield the gyro's and the accelerometer's other axes in the place of the right ones."""
    for axis, name in ((0, "x"), (2, "z")):
        gyro, _ = predicted(rows, robot, axis)
        yield _scaled(f"gyro axis {name}", rows, rows.force[:, 0], gyro, wheels)
    gyro, _ = predicted(rows, robot)
    for axis, name in ((1, "y"), (2, "z")):
        force = rows.force[:, axis]
        yield _scaled_force(f"accelerometer axis {name}", rows, force, gyro, wheels)


def _turned(rows: Rows, robot: Robot) -> Iterator[Cause]:
    """Yield a sensor that sits turned about the vertical by quarters."""
    _, wheels = predicted(rows, robot)
    for quarters in (1, 2, 3):
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarters]
        across, _ = predicted(rows, robot, 0)
        along, _ = predicted(rows, robot)
        force = cosine * rows.force[:, 0] - sine * rows.force[:, 1]
        yield _exact(f"turned {90 * quarters}", force, sine * across + cosine * along, wheels)


def _lengths(rows: Rows, robot: Robot) -> Iterator[Cause]:
    force, placed = rows.force[:, 0], on_body(robot)
    assert rows.wheels is not None
    turning = rows.turning[:, 1]
    gravity = -STANDARD_GRAVITY * rows.turn[:, 1]
    rolled = robot.wheel_radius * (rows.wheels.mean(axis=1) + placed * turning)
    lifted = robot.lever_arm[2] * turning
    yield _scaled("wheel radius", rows, force, rolled, gravity + lifted)
    arm = _scaled("lever arm", rows, force, turning, gravity + rolled)
    # Its ratio is a length [m], since the configured one may be 0.
    yield arm._replace(size=_size(force, gravity + arm.ratio * turning, rolled))


def _other_placement(rows: Rows, robot: Robot) -> Cause:
    placed = robot.encoder_placement is EncoderPlacement.BODY
    other = EncoderPlacement.GROUND if placed else EncoderPlacement.BODY
    gyro, wheels = predicted(rows, replace(robot, encoder_placement=other))
    return _exact(other.value, rows.force[:, 0], gyro, wheels)


def _single_wheels(rows: Rows, robot: Robot, gyro: FloatArray) -> Iterator[Cause]:
    """Yield one wheel counted backward, in another unit, or that shows nothing."""
    assert rows.wheels is not None
    left, right = robot.wheel_radius * rows.wheels.T
    force = rows.force[:, 0]
    for name, other, own in (("left wheel", right, left), ("right wheel", left, right)):
        yield _exact(f"{name} reversed", force, gyro, 0.5 * (other - own), -1.0)
        yield _exact(f"{name} wrong", force, gyro, other, 0.0)
        scaled = _scaled(f"{name} scaled", rows, force, 0.5 * own, gyro + 0.5 * other)
        size = _size(force, gyro, 0.5 * (scaled.ratio * own + other))
        yield scaled._replace(size=size)
