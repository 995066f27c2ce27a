"""Where the navigation began, and what repairs have made of it since.

The navigation is what a beginning and the gyro make of it, and what was repaired since by wheels
and all else. Undone, the repairs leave a navigation that wheels have not touched since then: that
of the first reading or, once wheels have proven right, of the time when they last were.
"""

from __future__ import annotations

from typing import NamedTuple

from ...samples import STANDARD_GRAVITY
from .error_state import ATTITUDE, VELOCITY, Array

DRIFT, KNOWN_DRIFT = 0.002, 2e-5
"""Growth of the variance by a gyro that was just switched on, and by one whose errors are known
[rad^2/s]."""
RENEWED = 1.5
"""So old is a beginning that the next one follows, while wheels are right [s]."""
PULLED = 2.5
"""Wheels that have not been right yet are wrong where they turn the navigation away from its
beginning by so many standard deviations of that."""


class Beginning(NamedTuple):
    """A navigation some time ago, and how it was repaired since."""

    variance: float
    """Of its tilt then, with what the gyro has not seen since [rad^2]."""
    drift: float
    """Growth of that [rad^2/s]."""
    lasted: float
    """Time since then [s]."""
    turned: tuple[float, float]
    """Turn of the attitude by repairs, level axes [rad]."""
    sped: tuple[float, float]
    """What repairs have added to the velocity, level axes [m/s]."""


def begin(variance: float, drift: float) -> Beginning:
    """Begin with the variance of the tilt [rad^2] and its growth [rad^2/s]."""
    return Beginning(variance, drift, 0.0, (0.0, 0.0), (0.0, 0.0))


def carried(beginning: Beginning, unseen: float, dt: float) -> Beginning:
    """Return the beginning `dt` [s] later, in which the gyro missed a variance [rad^2]."""
    return Beginning(
        beginning.variance + unseen + beginning.drift * dt,
        beginning.drift,
        beginning.lasted + dt,
        beginning.turned,
        beginning.sped,
    )


def with_repair(beginning: Beginning, error: Array, time: float) -> Beginning:
    """Return the beginning after another repair, `time` [s] after the last."""
    (x, y), (ahead, aside) = beginning.turned, beginning.sped
    push = STANDARD_GRAVITY * time
    return Beginning(
        beginning.variance,
        beginning.drift,
        beginning.lasted,
        (x + error[ATTITUDE], y + error[ATTITUDE + 1]),
        (ahead + error[VELOCITY] + push * y, aside + error[VELOCITY + 1] - push * x),
    )


def unrepaired(beginning: Beginning) -> Beginning:
    """Return the beginning of a navigation whose repairs were undone."""
    none = (0.0, 0.0)
    return Beginning(beginning.variance, beginning.drift, beginning.lasted, none, none)


def pulled_away(beginning: Beginning) -> bool:
    """Whether repairs have turned the navigation further than the first reading can be wrong."""
    x, y = beginning.turned
    return x * x + y * y > PULLED * PULLED * beginning.variance
