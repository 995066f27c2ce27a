"""The model of the robot that filters predict with: state, motion, and inputs of the IMU.

The state is tilt, wheels against the body, heading and their rates, Sihite 2018 (28). In a filter
that calibrates itself four more follow: gyro bias, share of the yaw rate in the tilt gyro's
reading, accelerometer bias, and the sensor's position before the axle.

The damped motion of the wheels is integrated exactly, because a stiff motor makes the Euler steps
of (41) unstable.
"""

import math
from typing import NamedTuple

import numpy as np

from ...plants.sihite2018 import (
    Linear,
    linearised,
    linearised_as_printed,
    linearised_by_27,
    spatial_parameters,
)
from ...robot import EncoderPlacement, Robot
from ...samples import CorrectedSample
from .covariance import Array, identity

TILT, WHEEL, HEADING, TILT_RATE, WHEEL_RATE, YAW_RATE = range(6)
GYRO_BIAS, CROSS_AXIS, ACCEL_BIAS, OFFSET = range(6, 10)
"""Indices in the state; the filters of the paper do not have the second line."""


class Model(NamedTuple):
    """Motion of the robot and inputs of its sensors."""

    linear: Linear
    force_per_tilt: float
    """Forward specific force at the IMU per tilt [m/s^2]; (32) solved, the numbers of (52)."""
    force_per_wheel_rate: float
    force_per_command: float
    force_per_spin: float
    """Per tilt times squared yaw rate [m]."""
    offset: float
    """Of the IMU before the axle [m]."""
    heading_per_difference: float
    """Turn of the robot per turn of the right wheel against the left; 0 where unknown."""
    on_ground: float
    """1 where the encoder counts against the ground."""
    turns: float
    """1 where the model has the yaw rate, 0 for a robot in a plane."""
    change_share: float
    """Share of a step's change of rate that enters the tilt: 0 is Euler's (41), a half is right."""


def model_of(
    robot: Robot, *, turns: bool, printed: bool = False, change_share: float = 0.0
) -> Model:
    """Return the model of a robot.

    Args:
        robot: its mechanics and where its IMU sits.
        turns: whether it has the yaw rate.
        printed: whether the terms of the squared yaw rate are those of (46), (47) and (52).
        change_share: share of a step's change of rate that enters the tilt.
    """
    plant = spatial_parameters(robot)
    linear, sensed = linearised(plant), linearised(plant)
    if printed:
        linear, sensed = linearised_as_printed(plant), linearised_by_27(plant)
    known = robot.track_width > 0.0
    radius, upper = robot.wheel_radius, robot.wheel_radius + robot.lever_arm[2]
    return Model(
        linear,
        upper * sensed.tilt_per_tilt + radius * sensed.wheel_per_tilt - plant.gravity,
        upper * sensed.tilt_per_wheel_rate + radius * sensed.wheel_per_wheel_rate,
        upper * sensed.tilt_per_command + radius * sensed.wheel_per_command,
        upper * sensed.tilt_per_spin + radius * sensed.wheel_per_spin - robot.lever_arm[2],
        robot.lever_arm[0],
        robot.wheel_radius / robot.track_width if known else 0.0,
        float(robot.encoder_placement is EncoderPlacement.GROUND),
        float(turns),
        change_share,
    )


def _decay(rate: float, dt: float) -> tuple[float, float, float]:
    """Return exp(rate dt), its integral over dt, and the integral of that."""
    if rate * dt > -1e-9:
        return 1.0, dt, 0.5 * dt * dt
    once = math.expm1(rate * dt) / rate
    return 1.0 + rate * once, once, (once - dt) / rate


def predicted(x: Array, sample: CorrectedSample, model: Model) -> tuple[Array, Array]:
    """Return the state one sample later, (n,), and its slopes, (n, n); (40)-(48)."""
    dt, a = sample.dt, model.linear
    sine, cosine = math.sin(x[TILT]), math.cos(x[TILT])
    spin = x[YAW_RATE] * x[YAW_RATE]
    f, after = identity(x.size), x.copy()
    keep, once, twice = _decay(a.wheel_per_wheel_rate, dt)
    push = (a.wheel_per_tilt + a.wheel_per_spin * spin) * sine
    push += a.wheel_per_command * sample.voltage
    rolled = once * x[WHEEL_RATE] + twice * push
    after[WHEEL] += rolled
    after[WHEEL_RATE] = keep * x[WHEEL_RATE] + once * push
    lean = a.wheel_per_tilt + a.wheel_per_spin * spin
    swirl = 2.0 * a.wheel_per_spin * sine * x[YAW_RATE]
    f[WHEEL, TILT], f[WHEEL, WHEEL_RATE] = twice * lean * cosine, once
    f[WHEEL, YAW_RATE] = twice * swirl
    f[WHEEL_RATE, TILT], f[WHEEL_RATE, WHEEL_RATE] = once * lean * cosine, keep
    f[WHEEL_RATE, YAW_RATE] = once * swirl
    lean = a.tilt_per_tilt + a.tilt_per_spin * spin
    swirl = 2.0 * a.tilt_per_spin * sine * x[YAW_RATE]
    change = dt * (lean * sine + a.tilt_per_command * sample.voltage)
    change += a.tilt_per_wheel_rate * rolled
    after[TILT_RATE] += change
    after[TILT] += dt * (x[TILT_RATE] + model.change_share * change)
    for j in (TILT, WHEEL_RATE, YAW_RATE):
        f[TILT_RATE, j] = a.tilt_per_wheel_rate * f[WHEEL, j]
    f[TILT_RATE, TILT] += dt * lean * cosine
    f[TILT_RATE, YAW_RATE] += dt * swirl
    for j in (TILT, WHEEL_RATE, YAW_RATE):
        f[TILT, j] = model.change_share * dt * f[TILT_RATE, j]
    f[TILT, TILT] += 1.0
    f[TILT, TILT_RATE] = dt
    if model.turns > 0.0:
        keep, once, twice = _decay(a.yaw_per_yaw_rate, dt)
        torque = a.yaw_per_command * 0.5 * sample.voltage_difference
        after[HEADING] += once * x[YAW_RATE] + twice * torque
        after[YAW_RATE] = keep * x[YAW_RATE] + once * torque
        f[HEADING, YAW_RATE], f[YAW_RATE, YAW_RATE] = once, keep
    return after, f


def forward_force(x: Array, voltage: float, model: Model) -> tuple[float, Array]:
    """Return what the accelerometer reads [m/s^2], and its slopes, (n,); (32), (52)."""
    spin = x[YAW_RATE] * x[YAW_RATE]
    sine, cosine = math.sin(x[TILT]), math.cos(x[TILT])
    per_tilt, h = model.force_per_tilt + model.force_per_spin * spin, np.zeros(x.size)
    h[TILT], h[WHEEL_RATE] = per_tilt * cosine, model.force_per_wheel_rate
    expected = per_tilt * sine + h[WHEEL_RATE] * x[WHEEL_RATE]
    offset = model.offset
    if x.size > GYRO_BIAS:
        offset = x[OFFSET]
        h[ACCEL_BIAS], h[OFFSET] = 1.0, -spin
        expected += x[ACCEL_BIAS]
    h[YAW_RATE] = 2.0 * (model.force_per_spin * sine - offset) * x[YAW_RATE]
    expected += model.force_per_command * voltage - offset * spin
    return expected, h
