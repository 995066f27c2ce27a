"""The engine of the filters with a model of the robot, Sihite 2018 (40)-(57).

Motor voltages drive the prediction; wheel encoders, gyro and the forward specific force correct
it. The specific force is the calibrated reading in body axes, with the terms of the robot's
motion, because the model includes them. It is predicted for the IMU's own place
(`Robot.lever_arm`), where the paper's IMU sits at the centre of mass.

Without wheels or motors, after a fall, or after a pause, the model cannot be used: the gyro is then
integrated and the corrected angle measured, as in the complementary Kalman filter (2), (39).
"""

from typing import NamedTuple

import numpy as np

from ...samples import CorrectedSample, TiltEstimate
from .covariance import Array, advanced, forget, observed
from .model import (
    CROSS_AXIS,
    GYRO_BIAS,
    HEADING,
    OFFSET,
    TILT,
    TILT_RATE,
    WHEEL,
    WHEEL_RATE,
    YAW_RATE,
    Model,
    forward_force,
    predicted,
)

LARGEST_TILT = 0.5
"""Beyond this the body may lie on the ground [rad]."""
LONGEST_STEP = 0.05
"""A longer pause of the samples is not predicted by the model [s]."""
LOST, LOST_SECONDS = 0.5, 1.0
"""Mean deviation from the corrected angle at which the filter restarts [rad], and its time."""
FIRST_WHEEL_RATE = 10.0
"""Standard deviation of the wheels' rate when they come in [rad/s]."""
FIRST_YAW_RATE = 0.5
"""The same of the yaw rate, which the gyro measures [rad/s]."""
TILT_SHARE = 0.02
"""(39): growth of the tilt's variance per second, as a share of that of the angle."""


class Noise(NamedTuple):
    """Variances: of the first state, what is added per second, and of the measurements."""

    first: tuple[float, ...]
    growth: tuple[float, ...]
    wheel: float
    gyro: float
    accel: float
    heading: float
    yaw_gyro: float
    """0 where the yaw gyro is only used in place of two wheels."""
    angle: float


class Coefficients(NamedTuple):
    """Constants of a step."""

    model: Model
    noise: Noise


class Core(NamedTuple):
    """State between two steps."""

    x: Array
    """State, (n,)."""
    p: Array
    """Its covariance, (n, n)."""
    gyro: float
    """The tilt gyro one sample ago [rad/s]."""
    wheels: float
    """Wheel encoders in use; 0 where the model was not used."""
    gap: float
    """Mean of the corrected angle minus the tilt, recently [rad]."""


class PendulumState(NamedTuple):
    """Estimate and what it comes from."""

    tilt: float
    rate: float
    tilt_variance: float
    core: Core


def start(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> Core:
    """Continue from `estimate`; the wheels come in with the next sample."""
    size = len(c.noise.first)
    x, p = np.zeros(size), np.zeros((size, size))
    for i in range(size):
        p[i, i] = c.noise.first[i]
    x[TILT], x[TILT_RATE] = estimate.tilt, estimate.rate
    if size > GYRO_BIAS:
        x[GYRO_BIAS], x[OFFSET] = estimate.gyro_bias, c.model.offset
    return Core(x, p, sample.gyro_y, 0.0, 0.0)


def state_of(core: Core) -> PendulumState:
    """Return the estimate of a filter without a gyro bias."""
    x = core.x
    return PendulumState(float(x[TILT]), float(x[TILT_RATE]), float(core.p[TILT, TILT]), core)


def stepped(core: Core, sample: CorrectedSample, c: Coefficients) -> Core:
    """Predict and correct, by the model where there is one."""
    share = min(sample.dt / LOST_SECONDS, 1.0)
    gap = core.gap + share * (sample.angle - core.x[TILT] - core.gap)
    if abs(gap) > LOST:
        bias = core.x[GYRO_BIAS] if core.x.size > GYRO_BIAS else 0.0
        return start(TiltEstimate(sample.angle, sample.gyro_y - bias, bias, 0.0), sample, c)
    known = sample.wheel_count > 0.0 and sample.motor_count > 0.0
    if not (known and abs(core.x[TILT]) < LARGEST_TILT and sample.dt <= LONGEST_STEP):
        return _without_model(core, sample, gap, c)
    if core.wheels != sample.wheel_count:
        return _with_wheels(_without_model(core, sample, gap, c), sample, c)
    x, f = predicted(core.x, sample, c.model)
    p = advanced(core.p, f, _growth(core.x.size, sample.dt, c.noise))
    x, p = _see_wheels(x, p, sample, c)
    x, p = _see_gyro(x, p, sample, c)
    x, p = _see_accelerometer(x, p, sample, c)
    return Core(x, p, sample.gyro_y, sample.wheel_count, gap)


def _growth(size: int, dt: float, noise: Noise) -> Array:
    growth = np.zeros(size)
    for i in range(size):
        growth[i] = noise.growth[i] * dt
    return growth


def _without_model(core: Core, sample: CorrectedSample, gap: float, c: Coefficients) -> Core:
    """Integrate the gyro and correct with the angle; wheels and heading are let go."""
    dt, size, x, p = sample.dt, core.x.size, core.x.copy(), core.p.copy()
    if core.wheels > 0.0:
        for index in (WHEEL, WHEEL_RATE, HEADING, YAW_RATE):
            forget(p, index, 0.0)
    bias = 0.0
    if size > GYRO_BIAS:
        bias = x[GYRO_BIAS] + x[CROSS_AXIS] * sample.gyro_z
        _turn_by_bias(p, -dt, -dt * sample.gyro_z)
        for i in range(GYRO_BIAS, size):
            p[i, i] += c.noise.growth[i] * dt
    x[TILT] += dt * (0.5 * (core.gyro + sample.gyro_y) - bias)
    p[TILT, TILT] += TILT_SHARE * c.noise.angle * dt + sample.gyro_variance_y * dt * dt
    variance, residual = max(c.noise.angle, sample.angle_variance), sample.angle - x[TILT]
    if size > GYRO_BIAS:
        h = np.zeros(size)
        h[TILT] = 1.0
        x, p = observed(x, p, h, residual, variance)
        bias = x[GYRO_BIAS] + x[CROSS_AXIS] * sample.gyro_z
    else:  # the tilt is all there is
        gain = p[TILT, TILT] / (p[TILT, TILT] + variance)
        x[TILT] += gain * residual
        p[TILT, TILT] *= 1.0 - gain
    x[TILT_RATE] = sample.gyro_y - bias
    forget(p, TILT_RATE, max(c.noise.gyro, sample.gyro_variance_y))
    return Core(x, p, sample.gyro_y, 0.0, gap)


def _turn_by_bias(p: Array, bias: float, cross_axis: float) -> None:
    """Let the tilt take on these shares of two errors of the gyro: F P F'; changes `p`."""
    for j in range(p.shape[0]):
        p[TILT, j] += bias * p[GYRO_BIAS, j] + cross_axis * p[CROSS_AXIS, j]
    for i in range(p.shape[0]):
        p[i, TILT] += bias * p[i, GYRO_BIAS] + cross_axis * p[i, CROSS_AXIS]


def _with_wheels(core: Core, sample: CorrectedSample, c: Coefficients) -> Core:
    """Let the wheels come in, at rates that are not known well."""
    x, p = core.x, core.p
    x[WHEEL] = sample.wheel_angle - c.model.on_ground * x[TILT]
    x[WHEEL_RATE] = 0.0
    x[HEADING] = sample.wheel_difference * c.model.heading_per_difference
    x[YAW_RATE] = c.model.turns * sample.gyro_z
    forget(p, WHEEL, c.noise.wheel)
    forget(p, WHEEL_RATE, FIRST_WHEEL_RATE * FIRST_WHEEL_RATE)
    forget(p, HEADING, c.noise.heading)
    forget(p, YAW_RATE, c.model.turns * FIRST_YAW_RATE * FIRST_YAW_RATE)
    return Core(x, p, core.gyro, sample.wheel_count, core.gap)


def _see_wheels(
    x: Array, p: Array, sample: CorrectedSample, c: Coefficients
) -> tuple[Array, Array]:
    """Measure wheels and heading, the first and the last entry of (50)."""
    h = np.zeros(x.size)
    h[WHEEL], h[TILT] = 1.0, c.model.on_ground
    residual = sample.wheel_angle - x[WHEEL] - c.model.on_ground * x[TILT]
    x, p = observed(x, p, h, residual, c.noise.wheel)
    if c.model.turns == 0.0:
        return x, p
    both = sample.wheel_count == 2.0 and c.model.heading_per_difference > 0.0
    if both:
        heading = sample.wheel_difference * c.model.heading_per_difference
        h = np.zeros(x.size)
        h[HEADING] = 1.0
        x, p = observed(x, p, h, heading - x[HEADING], c.noise.heading)
    if not both or c.noise.yaw_gyro > 0.0:
        variance = max(c.noise.yaw_gyro, c.noise.gyro, sample.gyro_variance_z)
        h = np.zeros(x.size)
        h[YAW_RATE] = 1.0
        x, p = observed(x, p, h, sample.gyro_z - x[YAW_RATE], variance)
    return x, p


def _see_gyro(x: Array, p: Array, sample: CorrectedSample, c: Coefficients) -> tuple[Array, Array]:
    """Measure the tilt rate, (51)."""
    h = np.zeros(x.size)
    h[TILT_RATE] = 1.0
    expected = x[TILT_RATE]
    if x.size > GYRO_BIAS:
        h[GYRO_BIAS], h[CROSS_AXIS], h[YAW_RATE] = 1.0, x[YAW_RATE], x[CROSS_AXIS]
        expected += x[GYRO_BIAS] + x[CROSS_AXIS] * x[YAW_RATE]
    variance = max(c.noise.gyro, sample.gyro_variance_y)
    return observed(x, p, h, sample.gyro_y - expected, variance)


def _see_accelerometer(
    x: Array, p: Array, sample: CorrectedSample, c: Coefficients
) -> tuple[Array, Array]:
    """Measure the forward specific force, (32) and (52), at the IMU's own place."""
    expected, h = forward_force(x, sample.voltage, c.model)
    variance = max(c.noise.accel, sample.accel_variance_x)
    return observed(x, p, h, sample.accel_x - expected, variance)
