"""Readings at a sensor's full scale: how they are recognised and marked.

A saturated axis is flagged in the sample, 1.0 or 0.0. A message has no room for the flag, so its
covariance carries it: the variance of a flagged axis is above a mark, that of every other axis
at or below it.
"""

from __future__ import annotations

SATURATION_MARGIN = 0.999
"""A reading above this share of full scale counts as saturated."""
SATURATED_SHARE = 0.5
"""Standard deviation of a saturated reading, as a share of full scale."""
SATURATED_WEIGHT = 0.1
"""A body axis is saturated where saturated sensor axes hold this share of it or more; squared
elements of the rotation."""
GYRO_MARK = 1.0
"""Variance of a rate above which a message marks it as saturated [(rad/s)^2]."""
ACCEL_MARK = 10.0
"""Variance of a specific force above which a message marks it as saturated [(m/s^2)^2]."""


def flag(value: float, limit: float) -> float:
    """Return 1.0 where `value` reaches `limit`, else 0.0."""
    return 1.0 if value >= limit else 0.0


def marked(variance: float, saturated: float, mark: float) -> float:
    """Return the variance, moved to the side of the mark that its flag requires."""
    return max(variance, 2.0 * mark) if saturated > 0.0 else min(variance, mark)
