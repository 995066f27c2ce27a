"""The linear-quadratic regulator of Sun 2014, with the gains of the right model.

Its output is the force of both wheels on the ground; the robot's motor constants turn that into
a voltage, with what the turning motors induce. Sun's tilt is positive leaning backward.

The defaults are the gains of the right model for Q = diag(100, 1, 100, 1), R = 1. They belong to
the robot of the paper and its continuous model; they leave room enough for others of its size.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..robot import Robot
from .base import Bounds, Controller
from .state_feedback import Gains, State, reset, rolling_voltage, step
from .steering import YawGain, YawRateGain

TiltGain = Annotated[float, Bounds(0.0, 1e3, "N/rad", "K1: force per tilt")]
RateGain = Annotated[float, Bounds(0.0, 1e2, "N s/rad", "K2: force per tilt rate")]
PositionGain = Annotated[float, Bounds(-1e3, 0.0, "N/m", "K3: force per position, Sun's sign")]
VelocityGain = Annotated[float, Bounds(-1e3, 0.0, "N s/m", "K4: force per speed, Sun's sign")]


class Parameters(NamedTuple):
    """K of u = -K [phi, phi', x, x'], and the gains of the heading."""

    tilt_gain: TiltGain = 31.6556
    rate_gain: RateGain = 5.1479
    position_gain: PositionGain = -10.0
    velocity_gain: VelocityGain = -7.3214
    yaw_gain: YawGain = 3.0
    yaw_rate_gain: YawRateGain = 0.3


def derive(parameters: Parameters, robot: Robot, period: float) -> Gains:
    """Return the gains in volts."""
    del period
    per_force = (
        robot.wheel_radius
        * robot.winding_resistance
        / (2.0 * robot.gear_ratio * robot.torque_constant)
    )
    rolling = rolling_voltage(robot)
    return Gains(
        -per_force * parameters.position_gain,
        -per_force * parameters.velocity_gain + rolling,
        per_force * parameters.tilt_gain,
        per_force * parameters.rate_gain - rolling * robot.wheel_radius,
        rolling,
        0.0,
        parameters.yaw_gain,
        parameters.yaw_rate_gain,
        robot.supply_voltage,
    )


CONTROLLER = Controller(
    name="lqr_sun2014",
    title="Linear-quadratic regulator of Sun 2014, gains of the right model.",
    source="Sun 2014 (section IV B, V), A1 and B2 put right",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
)
