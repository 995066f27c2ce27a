"""The rig in three dimensions: a planar drive that turns and rolls as well.

Attitude, body to world: first the heading (yaw) about the world's vertical, then the roll of
the axle about the heading, then the tilt about the axle. The world's up direction in body axes
is then (-sin tilt cos roll, sin roll, cos tilt cos roll), so the tilt is atan2(-u_x, u_z): the
angle that an encoder on the axle measures, and `messages.tilt_of_quaternion` gives.

The middle of the axle moves along the heading with the planar drive's speed: no side slip.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray
from ..robot import Robot
from ..samples import STANDARD_GRAVITY
from .disturbances import STEP
from .planar_sensing import PlanarMotion
from .turning import Turning


class ImuInput(NamedTuple):
    """Input of an IMU, one row a step, in body axes."""

    rate: FloatArray
    """Angular rate [rad/s], (n, 3)."""
    force: FloatArray
    """Mean specific force over the step before [m/s^2], (n, 3)."""


def imu_input(
    planar: FloatArray, turning: Turning, arm: tuple[float, float, float], step: float = STEP
) -> ImuInput:
    """Return the input of an IMU.

    The specific force comes from differences of the sensor's velocity in the world, which hold
    every term of the lever arm, and an impulse within the step.

    Args:
        planar: the planar drive, (n, 8) with the fields of `PlanarMotion`.
        turning: what is added to it, n steps.
        arm: position of the IMU from the middle of the axle, body axes [m].
        step: time between two rows [s].
    """
    tilt, velocity = _column(planar, "tilt"), _column(planar, "velocity")
    yaw = _integral(turning.yaw_rate, step)
    rate = body_rates(turning, tilt, _column(planar, "rate"))
    attitude = attitudes(yaw, turning.roll, tilt)
    moved = np.einsum("nij,nj->ni", attitude, np.cross(rate, arm))
    moved[:, 0] += velocity * np.cos(yaw)
    moved[:, 1] += velocity * np.sin(yaw)
    moved[:, 2] += turning.lift_speed
    lifted = np.diff(moved, axis=0, prepend=moved[:1]) / step
    lifted[:, 2] += _column(planar, "lift") + STANDARD_GRAVITY
    middle = attitudes(*(_middle(angle) for angle in (yaw, turning.roll, tilt)))
    shake = np.column_stack(
        [_column(planar, name) for name in ("shake_forward", "shake_left", "shake_up")]
    )
    return ImuInput(rate, np.einsum("nij,ni->nj", middle, lifted) + shake)


def attitudes(yaw: FloatArray, roll: FloatArray, tilt: FloatArray) -> FloatArray:
    """Return the rotations from body to world, (n, 3, 3), for angles [rad], (n,)."""
    (sy, cy), (sr, cr), (st, ct) = ((np.sin(a), np.cos(a)) for a in (yaw, roll, tilt))
    rows = (
        (cy * ct - sy * sr * st, -sy * cr, cy * st + sy * sr * ct),
        (sy * ct + cy * sr * st, cy * cr, sy * st - cy * sr * ct),
        (-cr * st, sr, cr * ct),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def body_rates(turning: Turning, tilt: FloatArray, tilt_rate: FloatArray) -> FloatArray:
    """Return the angular rate in body axes [rad/s], (n, 3), from angles and their rates."""
    upright = turning.yaw_rate * np.cos(turning.roll)
    sine, cosine = np.sin(tilt), np.cos(tilt)
    return np.column_stack(
        [
            turning.roll_rate * cosine - upright * sine,
            tilt_rate + turning.yaw_rate * np.sin(turning.roll),
            turning.roll_rate * sine + upright * cosine,
        ]
    )


def wheel_angles(
    planar: FloatArray, turning: Turning, robot: Robot, step: float = STEP
) -> FloatArray:
    """Return how far the left and the right wheel have turned in the body [rad], (n, 2).

    A wheel rolls over the ground as fast as its end of the axle moves along the heading; what
    the axle turns about itself, tilt and the yaw's share on a slope, the wheel need not.

    Args:
        planar: the planar drive without slip, (n, 8) with the fields of `PlanarMotion`.
        turning: what is added to it, n steps; its slip is counted.
        robot: the true one.
        step: time between two rows [s].
    """
    travel = _column(planar, "wheel_travel")
    side = 0.5 * robot.track_width * turning.yaw_rate * np.cos(turning.roll)
    pitched = _column(planar, "tilt") + _integral(turning.yaw_rate * np.sin(turning.roll), step)
    angles = [
        (travel + _integral(slip + sign * side, step)) / robot.wheel_radius - pitched
        for sign, slip in zip((-1.0, 1.0), turning.slip.T, strict=True)
    ]
    return np.column_stack(angles)


def in_sensor_axes(body: ImuInput, rotation: NDArray[np.float64], cross: FloatArray) -> ImuInput:
    """Return the input of the sensing elements.

    Args:
        body: input in body axes.
        rotation: sensor to body, (3, 3).
        cross: cross-axis sensitivity of the gyro, (3, 3), its diagonal 0.
    """
    rate = body.rate @ rotation
    return ImuInput(rate + rate @ cross.T, body.force @ rotation)


def _column(planar: FloatArray, name: str) -> FloatArray:
    """Return one field of `PlanarMotion` over time."""
    return planar[:, PlanarMotion._fields.index(name)]


def _integral(rate: FloatArray, step: float) -> FloatArray:
    """Return the integral from the first row on, by the trapezoidal rule."""
    mean = 0.5 * (rate[1:] + rate[:-1])
    return np.concatenate([[0.0], np.cumsum(mean) * step])


def _middle(angle: FloatArray) -> FloatArray:
    """Return an angle in the middle of the step before."""
    return angle - 0.5 * np.diff(angle, prepend=angle[:1])
