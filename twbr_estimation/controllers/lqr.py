"""The linear-quadratic regulator of the user's own robot, computed from `robot.yaml`.

The robot's mechanics give the linearised plant, Laddach 2022 (2) in its right form, sampled at
the controller's period; a voltage acts one period after its command, which the plant
includes as a fifth state.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..robot import Robot
from .base import Bounds, Controller
from .riccati import delayed_gains
from .state_feedback import Gains, State, reset, rolling_voltage, step
from .steering import YawGain, YawRateGain


class Parameters(NamedTuple):
    """Weights of the cost, and the gains of the heading."""

    position_weight: Annotated[
        float, Bounds(1e-6, 1e6, "1/m^2", "Cost of being off the target", logarithmic=True)
    ] = 3.06
    velocity_weight: Annotated[
        float, Bounds(1e-6, 1e6, "s^2/m^2", "Cost of a wrong speed", logarithmic=True)
    ] = 0.1
    tilt_weight: Annotated[
        float, Bounds(1e-6, 1e6, "1/rad^2", "Cost of a lean", logarithmic=True)
    ] = 31.3
    rate_weight: Annotated[
        float, Bounds(1e-6, 1e6, "s^2/rad^2", "Cost of a tilt rate", logarithmic=True)
    ] = 1.0
    voltage_weight: Annotated[
        float, Bounds(1e-6, 1e3, "1/V^2", "Cost of the voltage; larger acts softer", True)
    ] = 1.0
    yaw_gain: YawGain = 3.0
    yaw_rate_gain: YawRateGain = 0.3


def derive(parameters: Parameters, robot: Robot, period: float) -> Gains:
    """Return the gains.

    Raises:
        ConfigurationError: there are no gains for this robot.
    """
    found = delayed_gains(robot.plant(), period, parameters[:4], parameters.voltage_weight)
    position, velocity, tilt, rate, pending = (-gain for gain in found)
    return Gains(
        position,
        velocity,
        tilt,
        rate,
        rolling_voltage(robot),
        pending,
        parameters.yaw_gain,
        parameters.yaw_rate_gain,
        robot.supply_voltage,
    )


CONTROLLER = Controller(
    name="lqr",
    title="Linear-quadratic regulator computed for the robot in robot.yaml, with its delay.",
    source="Laddach 2022 (2), Sun 2014 (section IV B)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
)
