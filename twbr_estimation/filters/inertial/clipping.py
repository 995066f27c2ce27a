"""What a clipped gyro, or a gap, hides of a turn, and what the wheels show of it.

A fall that ends beyond the gyro's range gains speed as it did before: the hidden rate is as
uncertain as the last angular acceleration carried on. That of a blow, which saturates the
accelerometer, does not go on. About the vertical two wheel encoders
measure what a clipped yaw rate does not.
"""

import math
from typing import NamedTuple

from ...samples import CorrectedSample, is_saturated
from .navigation import gyro_saturated
from .strapdown import Matrix

UNSEEN_RATE = 10.0
"""Least standard deviation of a tilt rate beyond the gyro's range [rad/s]."""
UNSEEN_YAW = 10.0
"""Standard deviation of a yaw rate beyond the range [rad/s]."""
UNSEEN_TIME = 0.05
"""Least time over which such a rate stays alike [s]."""
SLOPE_MEMORY = 0.05
"""Time over which the largest angular acceleration is kept [s]."""
SLOPE_MARGIN = 1.5
"""Standard deviation of the angular acceleration while clipped, in that of before."""
FASTEST = 40.0
"""Largest standard deviation of a rate beyond the range [rad/s]."""
GAP = 0.03
"""A longer time between two samples hides a motion [s]."""
UNSEEN_TURNING = 20.0
"""Variance of the turn hidden in a gap, per cube of its length [rad^2/s^3]."""
SPUN_AFTER, SPUN_MEMORY = 0.1, 1.5
"""A yaw rate hidden for longer than the first [s] turns a lean by any angle, so that the tilt is
unknown; it stays so for as long again, at most for the second [s]."""
PER_LEAN, PER_LEAN_ON_WHEELS = 10.0, 3.0
"""Variance of that tilt per square of the lean, and where wheels tell that it stands on them."""
UPRIGHT = 0.3
"""Least cosine between the body's z axis and the vertical at which wheels show the yaw rate."""


class Clipping(NamedTuple):
    """What is remembered of the gyro's and the wheels' last readings."""

    slope: float
    """Largest angular acceleration about the left axis of late [rad/s^2]."""
    time: float
    """For how long the tilt rate has been beyond the range [s]."""
    spun: float
    """For how long the yaw rate has been, and nothing shows it; counted down afterwards [s]."""
    difference: float
    """Right minus left wheel angle one sample ago [rad]."""


def begin_clipping(sample: CorrectedSample) -> Clipping:
    """Begin with one sample."""
    return Clipping(0.0, 0.0, 0.0, sample.wheel_difference)


def clipped(before: Clipping, rate: float, sample: CorrectedSample) -> Clipping:
    """Return the memory one sample later; `rate` is the tilt rate one sample ago [rad/s]."""
    dt, slope, time = sample.dt, before.slope, 0.0
    if before.time == 0.0:
        slope *= SLOPE_MEMORY / (SLOPE_MEMORY + dt)
        if gyro_saturated(sample) or not is_saturated(sample):
            slope = max(slope, abs(sample.gyro_y - rate) / dt)
    if gyro_saturated(sample):
        time = before.time + dt
    spun = max(before.spun - dt, 0.0)
    if sample.gyro_saturated_z > 0.0:
        spun = min(before.spun + dt, SPUN_MEMORY)
    return Clipping(slope, time, spun, sample.wheel_difference)


def unseen_turn(clipping: Clipping, sample: CorrectedSample, body: Matrix) -> float:
    """Return the variance of what the gyro did not see of the last turn of the vertical [rad^2]."""
    dt, variance = sample.dt, 0.0
    memory = max(dt, clipping.time, UNSEEN_TIME)
    if gyro_saturated(sample):
        rate = min(max(UNSEEN_RATE, SLOPE_MARGIN * clipping.slope * clipping.time), FASTEST)
        variance += rate * rate * dt * memory
    if sample.gyro_saturated_z > 0.0:
        variance += _lean_squared(body) * UNSEEN_YAW * UNSEEN_YAW * dt * max(memory, clipping.spun)
    if dt > GAP:
        silent = dt - GAP
        variance += UNSEEN_TURNING * silent * silent * silent
    return variance


def spun_variance(clipping: Clipping, body: Matrix, wheels: float) -> float:
    """Return the variance of the tilt by a turn about the vertical that nothing shows [rad^2].

    Of the encoders, `wheels` are used.
    """
    per_lean = PER_LEAN_ON_WHEELS if wheels > 0.0 else PER_LEAN
    return per_lean * _lean_squared(body) if clipping.spun > SPUN_AFTER else 0.0


def _lean_squared(body: Matrix) -> float:
    """Return the squared sine of the angle between the body's z axis and the vertical."""
    return body[2] * body[2] + body[5] * body[5]


def rate_of_wheels(
    clipping: Clipping, sample: CorrectedSample, body: Matrix, yaw_per_difference: float
) -> float:
    """Return the rate about the body's z axis, by two wheels where the gyro is clipped [rad/s].

    Wheels that show less than the clipped gyro, or a turn the other way, show nothing.

    Args:
        clipping: one sample ago.
        sample: the new one.
        body: attitude one sample ago.
        yaw_per_difference: turn about the vertical per difference of the wheels' angles.
    """
    clip = sample.gyro_z
    if sample.wheel_count < 1.5 or abs(body[8]) < UPRIGHT:
        return clip
    yaw = yaw_per_difference * (sample.wheel_difference - clipping.difference) / sample.dt
    rate = (yaw - body[6] * sample.gyro_x - body[7] * sample.gyro_y) / body[8]
    return math.copysign(max(abs(rate), abs(clip)), clip) if rate * clip > 0.0 else clip
