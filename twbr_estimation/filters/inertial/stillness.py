"""Whether the body lies still, by gyro and accelerometer alone.

A run of readings that all stay near their mean is rest; the first one that does not begins the
next run. Nothing that happened before a run can delay its end.
"""

import math
from typing import NamedTuple

from ...samples import STANDARD_GRAVITY, CorrectedSample, is_saturated
from .strapdown import Vector, cross, unit

MEMORY = 0.3
"""Time over which the readings of a run are averaged [s]."""
STILL_AFTER = 0.15
"""So long must a run last [s]."""
LANDED_AFTER = 0.05
"""This is enough after a fall that clipped a sensor, where the vertical is less sure than what such
a run shows of it [s]."""
TURNING = 0.012
"""A rate further from the mean is motion [rad/s]."""
SURE_AFTER = 1.0
"""A run of this length is rest whatever constant rate the gyro shows [s]."""
ROLLED = 0.2
"""Before that, readings are no rest while wheels that nothing speaks against turn further [rad]."""
SLOW_TURNING = 0.02
"""Before that a mean rate further from the known bias is motion [rad/s]."""
LARGEST_BIAS = 0.4
"""A larger mean rate about an axis is motion: the zero of an MPU6050 is within 0.35 [rad/s]."""
UNEXPLAINED = 2.5
"""Standard deviation of the tilt per turn about level axes that no bias explains and that the
specific force does not show: it may all be bias."""
SILENT = 0.1
"""A longer time between two samples ends a run [s]."""
SHAKING = 0.2
"""A specific force further from the mean is motion [m/s^2]."""
RECENT = 0.05
"""Time over which the latest readings are averaged [s]."""
SWAYING = 0.08
"""A mean of the latest specific force further from that of the run is motion [m/s^2]."""
NOISE = 5.0
"""Deviations of so many standard deviations of the sensor's noise are none."""
HIDDEN = 0.010
"""Angle of a sway that may hide in a run of one second, and in inverse proportion [rad s]."""
GRAVITY_SHARE = 0.15
"""How far the specific force may be from gravity."""


class Stillness(NamedTuple):
    """The present run of quiet readings."""

    gyro: Vector
    """Mean rate [rad/s]."""
    accel: Vector
    """Mean specific force [m/s^2]."""
    recent: Vector
    """Mean of the latest specific force [m/s^2]."""
    time: float
    """Since when the readings are quiet [s]."""
    wheel: float
    """Wheel angle at its begin [rad]."""
    rolled: float
    """How far the wheels were from there at most [rad]."""


def begin_stillness(sample: CorrectedSample) -> Stillness:
    """Begin a run with one sample."""
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    return Stillness(gyro, accel, accel, 0.0, sample.wheel_angle, 0.0)


def is_still(stillness: Stillness, bias: Vector, wheels: bool, unseen: float) -> bool:
    """Whether the body lies still.

    Args:
        stillness: the run of quiet readings.
        bias: of the gyro [rad/s].
        wheels: whether there are any that nothing speaks against.
        unseen: variance of the vertical by turns of late that the gyro did not see [rad^2].
    """
    landed = stillness.time >= LANDED_AFTER and unseen > rest_variance(stillness)
    if stillness.time < STILL_AFTER and not landed:
        return False
    if stillness.time < SURE_AFTER and wheels and stillness.rolled > ROLLED:
        return False
    x, y, z = stillness.gyro
    x, y, z = x - bias[0], y - bias[1], z - bias[2]
    slow = x * x + y * y + z * z < SLOW_TURNING * SLOW_TURNING
    return slow or stillness.time >= SURE_AFTER


def noticed(stillness: Stillness, sample: CorrectedSample, held: tuple[float, float]) -> Stillness:
    """Return the stillness one sample later.

    Args:
        stillness: one sample ago.
        sample: the new one.
        held: for how long gyro and accelerometer have read just that; what froze while it turned
            repeats its reading [s].
    """
    if sample.dt > SILENT or is_saturated(sample):
        return begin_stillness(sample)
    gyro, accel, noise = stillness.gyro, stillness.accel, NOISE * NOISE
    p, q, r = sample.gyro_x - gyro[0], sample.gyro_y - gyro[1], sample.gyro_z - gyro[2]
    turning = max(TURNING * TURNING, noise * sample.gyro_variance_y)
    if p * p + q * q + r * r > turning:
        return begin_stillness(sample)
    x, y, z = sample.accel_x - accel[0], sample.accel_y - accel[1], sample.accel_z - accel[2]
    shaking = max(SHAKING * SHAKING, noise * sample.accel_variance_x)
    if x * x + y * y + z * z > shaking:
        return begin_stillness(sample)
    share = sample.dt / (min(stillness.time, MEMORY) + sample.dt)
    gyro = (gyro[0] + share * p, gyro[1] + share * q, gyro[2] + share * r)
    accel = (accel[0] + share * x, accel[1] + share * y, accel[2] + share * z)
    if max(abs(gyro[0]), abs(gyro[1]), abs(gyro[2])) > LARGEST_BIAS:
        return begin_stillness(sample)
    if min(held) > 0.0 and max(abs(gyro[0]), abs(gyro[1]), abs(gyro[2])) > SLOW_TURNING:
        return begin_stillness(sample)
    force = math.sqrt(accel[0] * accel[0] + accel[1] * accel[1] + accel[2] * accel[2])
    if abs(force - STANDARD_GRAVITY) > GRAVITY_SHARE * STANDARD_GRAVITY:
        return begin_stillness(sample)
    recent, new = stillness.recent, min(sample.dt / RECENT, 1.0)
    recent = (
        recent[0] + new * (sample.accel_x - recent[0]),
        recent[1] + new * (sample.accel_y - recent[1]),
        recent[2] + new * (sample.accel_z - recent[2]),
    )
    x, y, z = recent[0] - accel[0], recent[1] - accel[1], recent[2] - accel[2]
    swaying = max(SWAYING * SWAYING, 0.5 * shaking * new)
    if x * x + y * y + z * z > swaying:
        return begin_stillness(sample)
    rolled = max(stillness.rolled, abs(sample.wheel_angle - stillness.wheel))
    return Stillness(gyro, accel, recent, stillness.time + sample.dt, stillness.wheel, rolled)


def unexplained_rate(stillness: Stillness, bias: Vector) -> float:
    """Return the mean rate about level axes less that of a gyro of the bias [rad/s].

    A turn about the vertical may be one, as no specific force shows it.
    """
    (x, y, z), (a, b, c) = stillness.gyro, unit(stillness.accel)
    p, q, r = cross((a, b, c), (x - bias[0], y - bias[1], z - bias[2]))
    return math.sqrt(p * p + q * q + r * r)


def shows_bias(stillness: Stillness, bias: Vector) -> bool:
    """Whether a body that lies still shows that the gyro has another bias than the known one."""
    return stillness.time >= SURE_AFTER and unexplained_rate(stillness, bias) > SLOW_TURNING


def unexplained_variance(stillness: Stillness, bias: Vector) -> float:
    """Return the variance of the tilt by a rate that no known bias explains [rad^2]."""
    rate = unexplained_rate(stillness, bias)
    if stillness.time < STILL_AFTER or rate < SLOW_TURNING:
        return 0.0
    turn = UNEXPLAINED * rate * stillness.time
    return turn * turn


def rest_variance(stillness: Stillness) -> float:
    """Return how far the specific force may be off the vertical [rad^2].

    A slow sway whose acceleration hides in what counts as quiet is the less likely the longer
    it lasts.
    """
    off = HIDDEN / max(stillness.time, LANDED_AFTER)
    return off * off
