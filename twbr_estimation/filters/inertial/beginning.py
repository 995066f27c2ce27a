"""What the first reading and the gyro alone say, while nothing better is known.

The navigation is what the first reading began and the gyro carried on, and what was repaired
since. Undone, the repairs leave a navigation that its wheels have not touched.
"""

from __future__ import annotations

from typing import NamedTuple

from ...samples import STANDARD_GRAVITY
from .error_state import ATTITUDE, VELOCITY, Array

DRIFT = 0.002
"""Growth of the variance by the first reading: it is soon as well known otherwise [rad^2/s]."""
PULLED = 2.5
"""Wheels that have not been right yet are wrong where they turn the navigation away from its
beginning by so many standard deviations of that."""


class Beginning(NamedTuple):
    """The first reading, and how the navigation was repaired since."""

    variance: float
    """Of its tilt, with what the gyro has not seen since [rad^2]."""
    lasted: float
    """Time since then [s]."""
    turned: tuple[float, float]
    """Turn of the attitude by repairs, level axes [rad]."""
    sped: tuple[float, float]
    """What repairs have added to the velocity, level axes [m/s]."""


def begin(variance: float) -> Beginning:
    """Begin with the variance of the first tilt [rad^2]."""
    return Beginning(variance, 0.0, (0.0, 0.0), (0.0, 0.0))


def carried(beginning: Beginning, unseen: float, dt: float) -> Beginning:
    """Return the beginning `dt` [s] later, in which the gyro missed a variance [rad^2]."""
    return Beginning(
        beginning.variance + unseen + DRIFT * dt,
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
        beginning.lasted,
        (x + error[ATTITUDE], y + error[ATTITUDE + 1]),
        (ahead + error[VELOCITY] + push * y, aside + error[VELOCITY + 1] - push * x),
    )


def unrepaired(beginning: Beginning) -> Beginning:
    """Return the beginning of a navigation whose repairs were undone."""
    return Beginning(beginning.variance, beginning.lasted, (0.0, 0.0), (0.0, 0.0))


def pulled_away(beginning: Beginning) -> bool:
    """Whether repairs have turned the navigation further than the first reading can be wrong."""
    x, y = beginning.turned
    return x * x + y * y > PULLED * PULLED * beginning.variance
