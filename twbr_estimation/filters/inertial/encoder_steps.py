"""The steps in which a wheel encoder counts, found from what it shows."""

from typing import NamedTuple

FIRST_STEP = 0.15
"""An encoder counts in smaller steps than this [rad], as long as nothing else is known."""
STEP_SHARE = 0.2
"""Share of a new step in their mean."""


class Steps(NamedTuple):
    """The steps in which an encoder counts, as they are seen."""

    angle: float
    """Wheel angle one sample ago [rad]."""
    held: float
    """1 where it was the same one sample before that."""
    size: float
    """Mean step after a pause [rad]."""


def stepped(steps: Steps, angle: float) -> Steps:
    """Return what is known of the steps one sample later.

    None is larger than the smallest change of the angle; after a pause the change is one.
    """
    change = abs(angle - steps.angle)
    if change == 0.0:
        return Steps(angle, 1.0, steps.size)
    size = min(steps.size, change)
    if steps.held > 0.0 and change < FIRST_STEP:
        size = steps.size + STEP_SHARE * (change - steps.size)
    return Steps(angle, 0.0, size)
