"""Parts that all controllers share: target position, heading, and the two voltages."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from .base import Bounds, ControlInput

YawGain = Annotated[
    float, Bounds(0.0, 100.0, "V/rad", "Voltage per heading error, added right, taken off left")
]
YawRateGain = Annotated[float, Bounds(0.0, 20.0, "V s/rad", "Voltage per yaw rate error")]


class Target(NamedTuple):
    """Target position, from the commanded speed and yaw rate."""

    position: float
    """[m]."""
    heading: float
    """[rad]."""


FARTHEST = 0.5
"""Largest distance the target runs ahead of the robot [m]; a robot that is held waits for it."""
FARTHEST_TURN = 1.0
"""The same for the heading [rad]."""


def here(now: ControlInput) -> Target:
    """Return the target of a robot that stays at its place."""
    return Target(now.position, now.heading)


def moved(target: Target, now: ControlInput) -> Target:
    """Return the target one step later, never far from the robot."""
    position = target.position + now.target_velocity * now.dt
    heading = target.heading + now.target_yaw_rate * now.dt
    return Target(
        clamped(position, now.position - FARTHEST, now.position + FARTHEST),
        clamped(heading, now.heading - FARTHEST_TURN, now.heading + FARTHEST_TURN),
    )


def clamped(value: float, low: float, high: float) -> float:
    """Return `value`, or the limit it is beyond."""
    return min(max(value, low), high)


def turning_voltage(target: Target, now: ControlInput, gain: float, rate_gain: float) -> float:
    """Return what the right motor gets more, and the left one less [V]; Sihite 2018 (35).

    Args:
        target: target position and heading.
        now: where it heads.
        gain: of the heading's error [V/rad].
        rate_gain: of the yaw rate's error [V s/rad].
    """
    error, rate_error = target.heading - now.heading, now.target_yaw_rate - now.yaw_rate
    return gain * error + rate_gain * rate_error


def split(balance: float, turn: float, limit: float) -> tuple[float, float]:
    """Return left and right voltage within the supply; balancing comes before turning.

    Args:
        balance: what both motors get [V].
        turn: what the right one gets more, and the left one less [V].
        limit: the supply [V].
    """
    both = clamped(balance, -limit, limit)
    room = limit - abs(both)
    difference = clamped(turn, -room, room)
    return both - difference, both + difference
