"""Full state feedback on the motors' voltage, which the linear-quadratic regulators share."""

from __future__ import annotations

from typing import NamedTuple

from ..robot import Robot
from .base import ControlInput
from .steering import Target, here, moved, split, turning_voltage


class Gains(NamedTuple):
    """Voltage per unit of what the robot does, positive driving forward."""

    position: float
    """[V/m] of how far the robot is ahead of its target."""
    velocity: float
    """[V s/m] of how much faster it is than commanded."""
    tilt: float
    """[V/rad]."""
    rate: float
    """[V s/rad]."""
    command: float
    """[V s/m] of the commanded speed."""
    pending: float
    """[V/V] of the voltage asked for one period ago, which only acts now."""
    yaw: float
    """[V/rad] of the heading's error."""
    yaw_rate: float
    """[V s/rad] of the yaw rate's error."""
    limit: float
    """Supply [V]."""


class State(NamedTuple):
    """Voltages and target."""

    left: float
    right: float
    target: Target


def rolling_voltage(robot: Robot) -> float:
    """Return the voltage at which the motors roll along freely, per speed [V s/m]."""
    return robot.back_emf_constant * robot.gear_ratio / robot.wheel_radius


def reset(now: ControlInput, gains: Gains) -> State:
    """Begin where the robot stands."""
    del gains
    return State(0.0, 0.0, here(now))


def step(state: State, now: ControlInput, gains: Gains) -> State:
    """Take one step."""
    target = moved(state.target, now)
    voltage = (
        gains.position * (now.position - target.position)
        + gains.velocity * (now.velocity - now.target_velocity)
        + gains.tilt * now.tilt
        + gains.rate * now.rate
        + gains.command * now.target_velocity
        + gains.pending * 0.5 * (state.left + state.right)
    )
    turn = turning_voltage(target, now, gains.yaw, gains.yaw_rate)
    left, right = split(voltage, turn, gains.limit)
    return State(left, right, target)
