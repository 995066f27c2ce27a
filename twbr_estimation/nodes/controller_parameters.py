"""The parameters of all controllers, the choice among them and the robot, as one whole."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any

from rclpy.node import Node

from ..controllers.base import controller_named, listed_controllers
from ..errors import TwbrError
from ..parameters.bounds import Bounds, Meaning
from ..robot import Robot
from ..streams.control.balance import BalanceConfiguration, BalanceSettings
from ..streams.control.motors import ControlConfiguration, ControlSettings
from ..streams.inputs import JointSettings
from .declarations import (
    declarations_of,
    named_declarations_of,
    parameters_from,
    settings_from,
    with_choices,
)
from .parameters import NodeParameters

ROBOT = "robot."


class TiltSource(str, Enum):
    """Source of the tilt."""

    IMU = "imu"
    """`imu/data`: tilt, rate and stamp in one message."""
    TILT = "tilt"
    """`tilt`: a number without rate and stamp."""


@dataclass(frozen=True, slots=True)
class ControllerInputs(JointSettings):
    """Topics of the node; fixed at the start.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    input: Annotated[
        TiltSource,
        Meaning(
            "`imu` for tilt, rate and stamp of `imu/data`; `tilt` for the number on `tilt`, "
            "its rate derived and its stamp that of its arrival."
        ),
    ] = TiltSource.IMU
    use_stamped_vel: Annotated[
        bool,
        Meaning("Whether `cmd_vel` is geometry_msgs/TwistStamped; otherwise geometry_msgs/Twist."),
    ] = True
    publish_torque: Annotated[
        bool,
        Meaning(
            "Whether `motor/torque` goes out beside `motor/command`, for motors that take a torque."
        ),
    ] = False
    prepare_all: Annotated[
        bool,
        Meaning(
            "Prepare every controller in the background at the start, so that none keeps "
            "the robot waiting when it is switched to: `lqr` takes seconds the first time. "
            "False saves memory."
        ),
    ] = True
    balance_tilt: Annotated[
        float,
        Bounds(-1.5, 1.5, "rad", "Tilt at which the robot balances, subtracted"),
    ] = 0.0


def declare_controller_parameters(
    node: Node, apply: Callable[[ControlConfiguration], None]
) -> NodeParameters[ControlConfiguration]:
    """Declare them; `apply` takes over each accepted change.

    Raises:
        ConfigurationError: an initial value that is refused.
    """
    declared = [
        *with_choices(declarations_of(BalanceSettings()), "controller", listed_controllers()),
        *declarations_of(ControlSettings()),
        *declarations_of(Robot(), ROBOT),
    ]
    for entry in listed_controllers().values():
        declared.extend(named_declarations_of(entry))
    return NodeParameters(node, declared, ControlConfiguration(), _configuration, apply)


def prepare(configuration: ControlConfiguration) -> None:
    """Derive every controller, so that a switch to it finds the result; may take seconds."""
    balance = configuration.balance
    for name, entry in listed_controllers().items():
        with suppress(TwbrError):  # reported when it is switched to
            parameters = entry.configure(balance.parameters.get(name))
            entry.coefficients(parameters, balance.robot, balance.settings.period)


def _configuration(former: ControlConfiguration, values: Mapping[str, Any]) -> ControlConfiguration:
    balance = former.balance
    settings = settings_from(balance.settings, values)
    robot = settings_from(balance.robot, values, ROBOT)
    parameters = parameters_from(listed_controllers(), balance.parameters, values)
    entry = controller_named(settings.controller)
    # What cannot be derived must be refused here, before anything has changed.
    entry.coefficients(entry.configure(parameters.get(entry.name)), robot, settings.period)
    return ControlConfiguration(
        settings_from(former.control, values),
        BalanceConfiguration(settings, parameters, robot),
    )
