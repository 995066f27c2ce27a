"""Readings of the sensor as calibrated vectors in body axes: Laddach 2022 (7)-(12)."""

from __future__ import annotations

from ..samples import Sample, is_silent, is_weightless
from .coefficients import Coefficients, Rotation, Vector, spread
from .saturation import SATURATED_WEIGHT, flag, marked


def _scaled(
    reading: float, bias: float, limits: tuple[float, float], polynomial: tuple[float, ...]
) -> float:
    """Remove bias and scale error, Laddach 2022 (11), (12), with a clamped argument."""
    unbiased = reading - bias
    least, most = limits
    argument = least if unbiased < least else most if unbiased > most else unbiased
    error = 0.0
    for coefficient in polynomial:
        error = (error + coefficient) * argument
    return unbiased - error


def _to_body(r: Rotation, x: float, y: float, z: float) -> Vector:
    """Turn a vector of sensor axes into body axes."""
    a, b, c, d, e, f, g, h, i = r
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def calibrated_rate(sample: Sample, c: Coefficients) -> Vector:
    """Return the calibrated rate in body axes (8) [rad/s]; zeros of a silent chip."""
    if is_silent(sample):
        return 0.0, 0.0, 0.0
    (bias_x, bias_y, bias_z), (scale_x, scale_y, scale_z) = c.gyro_bias, c.gyro_scale
    return _to_body(
        c.rotation,
        (sample.gyro_x - bias_x) * scale_x,
        (sample.gyro_y - bias_y) * scale_y,
        (sample.gyro_z - bias_z) * scale_z,
    )


def calibrated_force(sample: Sample, c: Coefficients) -> Vector:
    """Return the calibrated specific force in body axes (11), (12) [m/s^2]; zeros of a dead one."""
    if is_weightless(sample):
        return 0.0, 0.0, 0.0
    bias_x, bias_y, bias_z = c.accel_bias
    limits_x, limits_y, limits_z = c.accel_limits
    polynomial_x, polynomial_y, polynomial_z = c.polynomials
    return _to_body(
        c.rotation,
        _scaled(sample.accel_x, bias_x, limits_x, polynomial_x),
        _scaled(sample.accel_y, bias_y, limits_y, polynomial_y),
        _scaled(sample.accel_z, bias_z, limits_z, polynomial_z),
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
    along_x, along_y, along_z = reading
    if -limit < along_x < limit and -limit < along_y < limit and -limit < along_z < limit:
        return unsaturated, (0.0, 0.0, 0.0)
    full_x = flag(abs(along_x), limit)
    full_y = flag(abs(along_y), limit)
    full_z = flag(abs(along_z), limit)
    x, y, z = spread(r, full_x, full_y, full_z)
    flags = flag(x, SATURATED_WEIGHT), flag(y, SATURATED_WEIGHT), flag(z, SATURATED_WEIGHT)
    x, y, z = spread(
        r,
        saturated if full_x > 0.0 else ordinary,
        saturated if full_y > 0.0 else ordinary,
        saturated if full_z > 0.0 else ordinary,
    )
    return (marked(x, flags[0], mark), marked(y, flags[1], mark), marked(z, flags[2], mark)), flags
