"""Physical limits of a robot's sensors: numbers beyond them are errors, not measurements.

The limits are far outside every full scale in the trade, so that readings in a wrong unit still
come through and can be recognised as such.
"""

from __future__ import annotations

import math

FASTEST = 600.0
"""Largest believable rate [rad/s]; the fastest gyros reach 70."""
STRONGEST = 2000.0
"""Largest believable specific force [m/s^2]: 200 g."""
FARTHEST = 1e7
"""Largest believable angle of a wheel [rad]."""
LARGEST_VARIANCE = 1e5
"""A larger variance, of whatever unit, marks a value as unknown."""
LARGEST_VOLTAGE = 1000.0
"""Largest believable voltage of a motor [V]."""
NOT_FINITE, BEYOND = "not_finite", "beyond_any_sensor"
"""Names under which refused readings are counted."""


def imu_fault(readings: tuple[float, ...]) -> str:
    """Return why gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2] cannot be; else nothing."""
    gx, gy, gz, ax, ay, az = readings
    if (
        -FASTEST <= gx <= FASTEST
        and -FASTEST <= gy <= FASTEST
        and -FASTEST <= gz <= FASTEST
        and -STRONGEST <= ax <= STRONGEST
        and -STRONGEST <= ay <= STRONGEST
        and -STRONGEST <= az <= STRONGEST
    ):
        return ""
    return BEYOND if all(map(math.isfinite, readings)) else NOT_FINITE


def wheel_fault(angle: float, difference: float) -> str:
    """Return why the wheels' mean angle and difference [rad] cannot be; else nothing."""
    if -FARTHEST <= angle <= FARTHEST and -FARTHEST <= difference <= FARTHEST:
        return ""
    return BEYOND if math.isfinite(angle) and math.isfinite(difference) else NOT_FINITE


def known_variance(variance: float, otherwise: float) -> float:
    """Return a variance, or `otherwise` where it is 0, negative, huge or no number: unknown."""
    return variance if 0.0 < variance <= LARGEST_VARIANCE else otherwise
