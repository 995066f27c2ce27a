"""What the check of the wheels found, in words."""

from __future__ import annotations

import math

from .wheel_check import SMALLEST, WheelCheck

STANDS = 0.1
"""Share of the larger mean square below which one of the two velocities stands still."""
ALIKE = 0.7
"""Correlation of both velocities from which on their ratio is a scale; below minus this, a sign."""
RIGHT = 1.25
"""Ratio, and its reciprocal, within which the wheels are right."""
ANYTHING = "lifted, slipping, or a wrong sign, radius or unit of the wheels"


def wheel_remarks(check: WheelCheck) -> tuple[str, ...]:
    """Return a sentence about the wheels while they are ignored.

    Args:
        check: after the latest sample.
    """
    if check.trust.ignored == 0.0:
        return ()
    since = f"the wheels contradict the IMU since {check.trust.since:.1f} s"
    return (f"{since}: {cause(check)}; wheels ignored",)


def cause(check: WheelCheck) -> str:
    """Return what the mean squares of both velocities look like.

    Args:
        check: while the wheels are ignored.
    """
    difference, wheels, felt = check.slow
    if max(wheels, felt) < SMALLEST * SMALLEST or min(wheels, felt) <= 0.0:
        return ANYTHING
    alike = 0.5 * (wheels + felt - difference) / math.sqrt(wheels * felt)
    if alike < -ALIKE:
        return "they turn against its motion; a wrong sign of the encoders (parameter signs)?"
    if alike > ALIKE:
        ratio = math.sqrt(wheels / felt)
        if 1.0 / RIGHT < ratio < RIGHT:
            return "they agree with it again, but have not yet for long enough"
        about = float(f"{ratio:.1g}")
        return f"they report about {about:g} times its motion; wheel_radius, gear ratio or unit?"
    if wheels < STANDS * felt:
        return "they stand while the robot moves; carried, or the encoders are dead?"
    if felt < STANDS * wheels:
        return "they turn while the robot does not move; lifted, slipping or held?"
    return ANYTHING
