"""A speed regulator that sets the tilt, and a tilt regulator that sets the voltage.

Chudzik 2021, section III C: both are discrete PID regulators, their integrals by the
trapezoidal rule. An integral stands still while its output is at its limit and would go
further. The derivative of the tilt is the measured rate.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..robot import Robot
from .base import Bounds, ControlInput, Controller
from .steering import Target, YawGain, YawRateGain, clamped, here, moved, split, turning_voltage


class Parameters(NamedTuple):
    """Gains of both regulators and of the heading."""

    tilt_gain: Annotated[float, Bounds(0.0, 500.0, "V/rad", "Voltage per tilt error")] = 40.0
    tilt_integral: Annotated[
        float, Bounds(0.0, 2000.0, "V/(rad s)", "Voltage per integral of the tilt error")
    ] = 50.0
    tilt_derivative: Annotated[float, Bounds(0.0, 100.0, "V s/rad", "Voltage per tilt rate")] = 2.0
    speed_gain: Annotated[float, Bounds(0.0, 20.0, "rad s/m", "Lean per speed error")] = 0.3
    speed_integral: Annotated[
        float, Bounds(0.0, 20.0, "rad/m", "Lean per distance from the robot's target position")
    ] = 0.05
    speed_derivative: Annotated[
        float, Bounds(0.0, 5.0, "rad s^2/m", "Lean per change of the speed error")
    ] = 0.0
    largest_lean: Annotated[
        float, Bounds(0.01, 1.0, "rad", "Largest tilt the speed regulator commands")
    ] = 0.3
    yaw_gain: YawGain = 3.0
    yaw_rate_gain: YawRateGain = 0.3


class Coefficients(NamedTuple):
    """Parameters and the supply."""

    gains: Parameters
    limit: float
    """[V]."""


class State(NamedTuple):
    """Voltages, target, and the two integrals with what they last took."""

    left: float
    right: float
    target: Target
    tilt_integral: float
    """[rad s]."""
    tilt_error: float
    speed_integral: float
    """[m]."""
    speed_error: float


def derive(parameters: Parameters, robot: Robot, period: float) -> Coefficients:
    """Return the coefficients."""
    del period
    return Coefficients(parameters, robot.supply_voltage)


def reset(now: ControlInput, c: Coefficients) -> State:
    """Begin at rest with empty integrals."""
    del c
    return State(0.0, 0.0, here(now), 0.0, now.tilt, 0.0, now.target_velocity - now.velocity)


def step(state: State, now: ControlInput, c: Coefficients) -> State:
    """Take one step of both regulators."""
    gains = c.gains
    target = moved(state.target, now)
    speed_error = now.target_velocity - now.velocity
    distance = state.speed_integral + 0.5 * now.dt * (speed_error + state.speed_error)
    wanted = gains.speed_gain * speed_error + gains.speed_integral * distance
    wanted += gains.speed_derivative * (speed_error - state.speed_error) / now.dt
    lean = clamped(wanted, -gains.largest_lean, gains.largest_lean)
    if (wanted - lean) * speed_error > 0.0:
        distance = state.speed_integral
    tilt_error = now.tilt - lean
    integral = state.tilt_integral + 0.5 * now.dt * (tilt_error + state.tilt_error)
    asked = gains.tilt_gain * tilt_error + gains.tilt_integral * integral
    asked += gains.tilt_derivative * now.rate
    if (asked - clamped(asked, -c.limit, c.limit)) * tilt_error > 0.0:
        integral = state.tilt_integral
    turn = turning_voltage(target, now, gains.yaw_gain, gains.yaw_rate_gain)
    left, right = split(asked, turn, c.limit)
    return State(left, right, target, integral, tilt_error, distance, speed_error)


CONTROLLER = Controller(
    name="pid",
    title="PID on the speed, which sets the tilt, and PID on the tilt.",
    source="Chudzik 2021 (section III C)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
)
