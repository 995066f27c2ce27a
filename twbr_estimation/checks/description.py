"""Whether the description of a robot can be that of a balancing robot."""

from __future__ import annotations

from collections.abc import Iterator

from ..robot import Robot
from .diagnosis import LONGEST_ARM
from .finding import Finding, Severity

SMALLEST_RADIUS, LARGEST_RADIUS = 0.005, 0.5
"""Wheel radii that are believed [m]."""


def description(robot: Robot) -> Iterator[Finding]:
    """Yield lengths that no balancing robot has."""
    if not SMALLEST_RADIUS <= robot.wheel_radius <= LARGEST_RADIUS:
        yield Finding(
            Severity.FAIL,
            "robot",
            "wheel radius",
            f"robot.wheel_radius is {robot.wheel_radius:g} m, not within {SMALLEST_RADIUS:g} and "
            f"{LARGEST_RADIUS:g} m: give m, not mm",
            parameter="robot.wheel_radius",
        )
    farthest = max(abs(length) for length in robot.lever_arm)
    if farthest > LONGEST_ARM:
        yield Finding(
            Severity.FAIL,
            "robot",
            "lever arm",
            f"robot.lever_arm is {list(robot.lever_arm)} m, more than {LONGEST_ARM:g} m: give m, "
            "not mm",
            parameter="robot.lever_arm",
        )
