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
"""No calibrated accelerometer is further off: what is beyond is not made up for, but doubted."""
DOUBT = 4.0
"""Standard deviation of the tilt per share beyond [rad]."""
FAR_FROM_GRAVITY = 0.5
"""A specific force further from that mean, as in a fall and its impacts, is left out: what it lacks
and what it exceeds rarely come to the same, as impacts go beyond the range and the bandwidth."""


class FeltGravity(NamedTuple):
    """What the accelerometer makes of gravity."""

    gain: float
    """Mean specific force along the vertical over standard gravity."""
    time: float
    """Time that the mean stands for [s]."""


def begin_gravity(gain: float) -> FeltGravity:
    """Begin with what the accelerometer seems to make of gravity; 1 where nothing is known."""
    return FeltGravity(gain, FIRST_TIME)


def factor_of(gravity: FeltGravity) -> float:
    """Return what to multiply specific forces with."""
    return 1.0 / min(max(gravity.gain, 1.0 - LARGEST), 1.0 + LARGEST)


def scale_variance(gravity: FeltGravity) -> float:
    """Return the variance of the tilt by an accelerometer that is not calibrated [rad^2]."""
    beyond = DOUBT * max(abs(gravity.gain - 1.0) - LARGEST, 0.0)
    return beyond * beyond


def weighed(gravity: FeltGravity, sample: CorrectedSample, body: Matrix) -> FeltGravity:
    """Return the mean one sample later.

    Args:
        gravity: one sample ago.
        sample: as read, not scaled.
        body: attitude.
    """
    x, y, z = sample.accel_x, sample.accel_y, sample.accel_z
    if abs(gravity_excess(sample) + 1.0 - gravity.gain) > FAR_FROM_GRAVITY or is_saturated(sample):
        return gravity
    up = body[6] * x + body[7] * y + body[8] * z
    time = min(gravity.time + sample.dt, LONGEST_TIME)
    gain = gravity.gain + sample.dt / time * (up / STANDARD_GRAVITY - gravity.gain)
    return FeltGravity(gain, time)
