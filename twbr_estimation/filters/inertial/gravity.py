"""How large the accelerometer reads gravity: the mean of the specific force along the vertical.

A body that neither rises nor sinks for long is pushed up by gravity alone. Horizontal accelerations
have no share in that mean.
"""

from typing import NamedTuple

from ...samples import STANDARD_GRAVITY, CorrectedSample, gravity_excess, is_saturated
from .strapdown import Matrix

FIRST_TIME, LONGEST_TIME = 5.0, 30.0
"""Times that the first guess, 1, and the mean stand for [s]."""
LARGEST = 0.08
"""No calibrated accelerometer is further off."""
FAR_FROM_GRAVITY = 0.5
"""A specific force further from gravity, as in a fall and its impacts, is left out: what it lacks
and what it exceeds rarely come to the same, as impacts go beyond the range and the bandwidth."""


class FeltGravity(NamedTuple):
    """What the accelerometer makes of gravity."""

    gain: float
    """Mean specific force along the vertical over standard gravity."""
    time: float
    """Time that the mean stands for [s]."""


def begin_gravity() -> FeltGravity:
    """Begin with an accelerometer that reads gravity right."""
    return FeltGravity(1.0, FIRST_TIME)


def weighed(gravity: FeltGravity, sample: CorrectedSample, body: Matrix) -> FeltGravity:
    """Return the mean one sample later.

    Args:
        gravity: one sample ago.
        sample: as read, not scaled.
        body: attitude.
    """
    x, y, z = sample.accel_x, sample.accel_y, sample.accel_z
    if abs(gravity_excess(sample)) > FAR_FROM_GRAVITY or is_saturated(sample):
        return gravity
    up = body[6] * x + body[7] * y + body[8] * z
    time = min(gravity.time + sample.dt, LONGEST_TIME)
    gain = gravity.gain + sample.dt / time * (up / STANDARD_GRAVITY - gravity.gain)
    return FeltGravity(min(max(gain, 1.0 - LARGEST), 1.0 + LARGEST), time)
