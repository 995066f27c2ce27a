"""Readings of the sensor as calibrated vectors in body axes: Laddach 2022 (7)-(12)."""

from __future__ import annotations

from ..samples import Sample
from .coefficients import Coefficients, Rotation, Vector, spread
from .saturation import SATURATED_WEIGHT, flag, marked


def _scaled(
    reading: float, bias: float, limits: tuple[float, float], polynomial: tuple[float, ...]
) -> float:
    """Remove bias and scale error, Laddach 2022 (11), (12), with a clamped argument."""
    unbiased = reading - bias
    argument = min(max(unbiased, limits[0]), limits[1])
    error = 0.0
    for coefficient in polynomial:
        error = (error + coefficient) * argument
    return unbiased - error


def _to_body(r: Rotation, x: float, y: float, z: float) -> Vector:
    """Turn a vector of sensor axes into body axes."""
    return (
        r[0] * x + r[1] * y + r[2] * z,
        r[3] * x + r[4] * y + r[5] * z,
        r[6] * x + r[7] * y + r[8] * z,
    )


def calibrated_rate(sample: Sample, c: Coefficients) -> Vector:
    """Return the calibrated rate in body axes (8) [rad/s]."""
    return _to_body(
        c.rotation,
        (sample.gyro_x - c.gyro_bias[0]) * c.gyro_scale[0],
        (sample.gyro_y - c.gyro_bias[1]) * c.gyro_scale[1],
        (sample.gyro_z - c.gyro_bias[2]) * c.gyro_scale[2],
    )


def calibrated_force(sample: Sample, c: Coefficients) -> Vector:
    """Return the calibrated specific force in body axes (11), (12) [m/s^2]."""
    return _to_body(
        c.rotation,
        _scaled(sample.accel_x, c.accel_bias[0], c.accel_limits[0], c.polynomials[0]),
        _scaled(sample.accel_y, c.accel_bias[1], c.accel_limits[1], c.polynomials[1]),
        _scaled(sample.accel_z, c.accel_bias[2], c.accel_limits[2], c.polynomials[2]),
    )


def doubt(
    reading: Vector,
    limit: float,
    unsaturated: Vector,
    ordinary: float,
    saturated: float,
    mark: float,
    r: Rotation,
) -> tuple[Vector, Vector]:
    """Return variances and saturation flags in body axes.

    Args:
        reading: In sensor axes, as the device reports it.
        limit: Magnitude from which an axis is saturated.
        unsaturated: Variances in body axes where none is.
        ordinary: Variance of a reading below it.
        saturated: Variance of a saturated one.
        mark: Variance that separates the two in a message.
        r: Rotation from sensor to body axes.
    """
    if -limit < reading[0] < limit and -limit < reading[1] < limit and -limit < reading[2] < limit:
        return unsaturated, (0.0, 0.0, 0.0)
    full_x = flag(abs(reading[0]), limit)
    full_y = flag(abs(reading[1]), limit)
    full_z = flag(abs(reading[2]), limit)
    x, y, z = spread(r, full_x, full_y, full_z)
    flags = flag(x, SATURATED_WEIGHT), flag(y, SATURATED_WEIGHT), flag(z, SATURATED_WEIGHT)
    x, y, z = spread(
        r,
        saturated if full_x > 0.0 else ordinary,
        saturated if full_y > 0.0 else ordinary,
        saturated if full_z > 0.0 else ordinary,
    )
    return (marked(x, flags[0], mark), marked(y, flags[1], mark), marked(z, flags[2], mark)), flags
