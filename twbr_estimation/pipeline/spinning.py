"""A body that something else turns about the vertical: a turntable, a hand, a robot below.

The sensor then runs on a circle of unknown radius, whose centripetal acceleration leans the
accelerometer for as long as that lasts, and with it a filter that follows it. A robot that turns on
the spot shows its turn by its two encoders, and its sensor's place is known; with fewer encoders
nothing tells the two apart, and nothing is doubted. `begin` and `spun` are pure functions on named
tuples, as those of `unseen`.
"""

import math
from typing import NamedTuple

from ..samples import STANDARD_GRAVITY, CorrectedSample

RADIUS = 0.3
"""Radius of the circle on which a sensor may be turned by something else [m]."""
MEMORY = 0.3
"""Time over which turn and wheels are averaged [s]."""
SHOWN = 0.5
"""Rate of the wheels' difference, per rate of the turn, from which on they show it: wheels that
are as large as their distance have 2."""
BEGUN, MISLEADING = 0.015, 0.055
"""Lean of the accelerometer [rad] from which on it is added up how far the filter follows it, and
from which on the filter's tilt may be wrong."""
LED = 0.04
"""How far a filter has to follow the accelerometer for its tilt to be doubted [rad]."""
HABIT_TIME = 5.0
"""Time over which `Spin.habit` is averaged [s]."""


class Spin(NamedTuple):
    """What is remembered of turns about the vertical."""

    rate: float
    """Rate about the vertical, averaged [rad/s]."""
    rolled: float
    """Rate of the wheels' difference, averaged [rad/s]."""
    difference: float
    """Of the wheels' angles [rad]."""
    encoders: float
    """Number of the encoders, 0 to 2."""
    habit: float
    """How fast the accelerometer moves the filter without such a turn, averaged [rad/s]: a bias of
    the gyro does that."""
    led: float
    """How far the accelerometer has moved the filter since the turn began, beyond that [rad]."""


def begin(sample: CorrectedSample) -> Spin:
    """Start with a first sample, that of a body which may have been turning before."""
    return Spin(_about_the_vertical(sample, sample.angle), 0.0, 0.0, 0.0, 0.0, 0.0)


def spun(before: Spin, sample: CorrectedSample, tilt: float, pull: float) -> Spin:
    """Take one sample.

    Args:
        before: what is known of the samples before.
        sample: the reading.
        tilt: the filter's [rad].
        pull: how far that is from what the gyro alone makes of its estimate before [rad].
    """
    dt = sample.dt
    share, encoders = dt / (dt + MEMORY), sample.wheel_count
    rate = before.rate + share * (_about_the_vertical(sample, tilt) - before.rate)
    moved = 0.0
    if encoders == 2.0 and before.encoders == 2.0:
        moved = abs(sample.wheel_difference - before.difference) / dt
    rolled = before.rolled + share * (moved - before.rolled)
    habit, led = before.habit, 0.0
    if _lean(rate, rolled, encoders) > BEGUN:
        led = before.led + pull - habit * dt
    else:
        habit += (pull - habit * dt) / (dt + HABIT_TIME)
    return Spin(rate, rolled, sample.wheel_difference, encoders, habit, led)


def leaned(now: Spin) -> float:
    """Return how far the turn may lean the accelerometer [rad]; 0 where that is not much."""
    found = _lean(now.rate, now.rolled, now.encoders)
    return found if found > MISLEADING else 0.0


def _lean(rate: float, rolled: float, encoders: float) -> float:
    if encoders < 2.0 or rolled > SHOWN * abs(rate):
        return 0.0
    return math.atan(rate * rate * RADIUS / STANDARD_GRAVITY)


def _about_the_vertical(sample: CorrectedSample, tilt: float) -> float:
    return sample.gyro_z * math.cos(tilt) - sample.gyro_x * math.sin(tilt)
