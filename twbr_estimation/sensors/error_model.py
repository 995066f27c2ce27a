"""Error model of an MPU6050, from the truth to a reading: the inverse of the correction.

One reading is made of: finite bandwidth, scale and its residual error, bias, sensitivity of
the gyro to acceleration, white noise, saturation and quantisation, Laddach 2022 (6)-(10).
The accelerometer's scale polynomial is inverted, so that the correction (11)-(12) gives
back what went in. Functions take floats and named tuples: interpreted or compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..robot import Calibration, Robot
from ..samples import STANDARD_GRAVITY

GYRO_RESOLUTION = math.radians(1.0 / 131.0)
"""One count of the gyro at +-250 deg/s [rad/s]."""
ACCEL_RESOLUTION = STANDARD_GRAVITY / 16384.0
"""One count of the accelerometer at +-2 g [m/s^2]."""
_LOWEST_COUNT, _HIGHEST_COUNT = -32768.0, 32767.0
_NEWTON_STEPS = 12

Triple = tuple[float, float, float]
Sextuple = tuple[float, float, float, float, float, float]


class ScaleError(NamedTuple):
    """Scale error of one accelerometer axis."""

    polynomial: tuple[float, ...]
    """S of Laddach 2022 (11), highest power first, no constant term."""
    low: float
    """Limit of the argument of S [m/s^2]."""
    high: float
    residual: float
    """Amplitude of what calibration has left over [m/s^2]."""
    phases: tuple[float, float]
    """Phases of the two waves of the residual [rad]."""


class ImuErrors(NamedTuple):
    """Everything that is wrong with one IMU, in its own axes, SI units and radians."""

    gyro_bias: Triple
    gyro_gain: Triple
    """Measured rate divided by true rate."""
    gyro_acceleration: float
    """Rate reading per forward or vertical acceleration [rad/s per m/s^2]."""
    gyro_noise: float
    """Standard deviation of one reading [rad/s]."""
    accel_bias: Triple
    accel_noise: Triple
    """Standard deviations of one reading [m/s^2]."""
    scale_x: ScaleError
    scale_y: ScaleError
    scale_z: ScaleError
    digital: bool
    """Whether readings saturate and are quantised."""
    gyro_resolution: float = GYRO_RESOLUTION
    """One count of the gyro [rad/s]."""
    accel_resolution: float = ACCEL_RESOLUTION
    """One count of the accelerometer [m/s^2]."""


def resolutions(robot: Robot) -> tuple[float, float]:
    """Return one count of gyro [rad/s] and accelerometer [m/s^2] at a robot's ranges."""
    gyro = robot.gyro_range / math.radians(250.0)
    accel = robot.accel_range / (2.0 * STANDARD_GRAVITY)
    return gyro * GYRO_RESOLUTION, accel * ACCEL_RESOLUTION


def scale_error(calibration: Calibration, axis: str) -> ScaleError:
    """Return the scale error of one axis (x, y, z) that `calibration` takes away."""
    ascending: tuple[float, ...] = getattr(calibration, f"accel_scale_{axis}")
    low, high = getattr(calibration, f"accel_valid_{axis}")
    descending = tuple(float(number) for number in reversed(ascending))
    return ScaleError((0.0,) * (5 - len(descending)) + descending, low, high, 0.0, (0.0, 0.0))


def unscaled(force: float, scale: ScaleError) -> float:
    """Return the reading p for which p - S(p) is `force`, Laddach 2022 (11) inverted."""
    reading = force
    for _ in range(_NEWTON_STEPS):
        argument = min(max(reading, scale.low), scale.high)
        value, slope = 0.0, 0.0
        for coefficient in scale.polynomial:
            slope = slope * argument + (value + coefficient)
            value = (value + coefficient) * argument
        inside = 1.0 if scale.low <= reading <= scale.high else 0.0
        reading -= (reading - value - force) / (1.0 - inside * slope)
    return reading


def residual_error(force: float, scale: ScaleError) -> float:
    """Return what calibration has left over at one specific force [m/s^2].

    Two waves too short for a polynomial of degree five, and nothing at zero: the bias was
    measured there.
    """
    long_phase, short_phase = scale.phases
    long_wave = math.sin(force * 0.6 + long_phase) - math.sin(long_phase)
    short_wave = math.sin(force * 1.5 + short_phase) - math.sin(short_phase)
    return scale.residual * (long_wave + 0.6 * short_wave)


def accel_reading(
    force: float, bias: float, noise: float, scale: ScaleError, resolution: float
) -> float:
    """Return the reading of one axis for a specific force.

    Args:
        force: true specific force [m/s^2].
        bias: of the axis [m/s^2].
        noise: drawn outside [m/s^2].
        scale: of the axis.
        resolution: one count [m/s^2]; 0 for an axis that is not digital.
    """
    reading = unscaled(force + residual_error(force, scale), scale) + bias + noise
    return _counted(reading, resolution) if resolution > 0.0 else reading


def read(
    rate: Triple, force: Triple, drift: Triple, noise: Sextuple, errors: ImuErrors
) -> Sextuple:
    """Return one reading: gyro x, y, z [rad/s], accelerometer x, y, z [m/s^2].

    Args:
        rate: true angular rate in sensor axes [rad/s].
        force: true specific force in sensor axes [m/s^2].
        drift: present deviation of the gyro biases [rad/s].
        noise: six standard normal numbers, gyro first.
        errors: the IMU.
    """
    push = errors.gyro_acceleration * (force[0] + force[2] - STANDARD_GRAVITY)
    x = errors.gyro_gain[0] * rate[0] + errors.gyro_bias[0] + drift[0] + push
    y = errors.gyro_gain[1] * rate[1] + errors.gyro_bias[1] + drift[1] + push
    z = errors.gyro_gain[2] * rate[2] + errors.gyro_bias[2] + drift[2] + push
    x += errors.gyro_noise * noise[0]
    y += errors.gyro_noise * noise[1]
    z += errors.gyro_noise * noise[2]
    if errors.digital:
        x, y, z = (
            _counted(x, errors.gyro_resolution),
            _counted(y, errors.gyro_resolution),
            _counted(z, errors.gyro_resolution),
        )
    bias, spread = errors.accel_bias, errors.accel_noise
    count = errors.accel_resolution if errors.digital else 0.0
    return (
        x,
        y,
        z,
        accel_reading(force[0], bias[0], spread[0] * noise[3], errors.scale_x, count),
        accel_reading(force[1], bias[1], spread[1] * noise[4], errors.scale_y, count),
        accel_reading(force[2], bias[2], spread[2] * noise[5], errors.scale_z, count),
    )


def low_passed(last: float, value: float, dt: float, time_constant: float) -> float:
    """Return the output of a first-order low-pass one step later; 0 s passes all."""
    if time_constant <= 0.0:
        return value
    return value + (last - value) * math.exp(-dt / time_constant)


def _counted(value: float, resolution: float) -> float:
    """Return `value` as a 16-bit register holds it."""
    counts = min(max(float(round(value / resolution)), _LOWEST_COUNT), _HIGHEST_COUNT)
    return counts * resolution
