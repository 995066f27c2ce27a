"""The linear-quadratic regulator of the user's own robot, computed from `robot.yaml`.

The robot's mechanics give the linearised plant, Laddach 2022 (2) in its right form, sampled at
the controller's period; a voltage acts one period after it was asked for, which the plant
includes as a fifth state. python-control solves the Riccati equation.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from ..errors import ConfigurationError
from ..plants.laddach2022 import linearised
from ..robot import Robot
from .base import Bounds, Controller
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
        ConfigurationError: python-control is missing, or finds no gains for this robot.
    """
    control = _library()
    a, b = linearised(robot.plant())
    sampled = control.sample_system(control.ss(a, b, np.eye(4), np.zeros((4, 1))), period)
    transition, entry = np.zeros((5, 5)), np.zeros((5, 1))
    transition[:4, :4], transition[:4, 4:] = sampled.A, sampled.B
    entry[4] = 1.0
    weights = np.diag([*parameters[:4], 0.0])
    try:
        gains, _, _ = control.dlqr(transition, entry, weights, [[parameters.voltage_weight]])
    except (ValueError, np.linalg.LinAlgError, control.ControlArgument) as error:
        raise ConfigurationError(f"lqr: no gains for this robot and period: {error}") from error
    position, velocity, tilt, rate, pending = (-float(gain) for gain in gains[0])
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


def _library() -> Any:
    """Import python-control, which takes seconds, only where it is needed."""
    try:
        import control
    except ImportError:
        raise ConfigurationError(
            "controller lqr needs python-control: pip install 'twbr_estimation[control]'"
        ) from None
    return control


CONTROLLER = Controller(
    name="lqr",
    title="Linear-quadratic regulator computed for the robot in robot.yaml, with its delay.",
    source="Laddach 2022 (2), Sun 2014 (section IV B), python-control",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
)
