"""Inputs of a node: topic names, waiting times, and messages about missing inputs."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..pipeline.pairing import DEFAULT_WAIT
from ..samples import Stamps
from .odometry import OdometryDecoder
from .wheels import WheelDecoder


class WheelSource(str, Enum):
    """Topic that shows how the wheels turn."""

    JOINT_STATES = "joint_states"
    """`joint_states`: angle or rate of each wheel."""
    ODOMETRY = "odometry"
    """`odom`, nav_msgs/Odometry: the forward speed of the base."""


@dataclass(frozen=True, slots=True)
class JointSettings:
    """Settings of `joint_states`.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    left_wheel_joint: Annotated[
        str,
        Meaning(
            "Name of the left wheel in `joint_states`; one of the two wheels is enough. "
            "Where a robot has neither joint, `wheel_joint` counts."
        ),
    ] = "left_wheel_joint"
    right_wheel_joint: Annotated[str, Meaning("Name of the right wheel in `joint_states`.")] = (
        "right_wheel_joint"
    )
    stamps: Annotated[
        Stamps,
        Meaning(
            "Clock that stamps the messages of the sensors: `header`, the sender's, must be set to "
            "that of this computer; `arrival`, the time at which a message comes; "
            "`device`, the sender's own clock, such as the time since it was switched on, related "
            "to ours. See docs/microcontroller.md."
        ),
    ] = Stamps.HEADER
    wheel_gear_ratio: Annotated[
        float,
        Bounds(
            0.001,
            1000.0,
            "",
            "Turns of the joints to one turn of the wheels: that of the gear where "
            "`joint_states` counts turns of the motors. A speed on `odom` is divided by it, too",
        ),
    ] = 1.0

    def __post_init__(self) -> None:
        require_bounds(self)


@dataclass(frozen=True, slots=True)
class InputSettings(JointSettings):
    """Settings of the IMU and wheel inputs.

    Raises:
        ConfigurationError: a number out of bounds.
    """

    timeout: Annotated[
        float, Bounds(0.01, 60.0, "s", "Without a sample for this long the input is stale")
    ] = 0.25
    wheel_wait: Annotated[
        float,
        Bounds(
            0.0,
            0.2,
            "s",
            "How much later than a sample its wheel reading may be stamped. Larger interpolates "
            "more and delays the tilt; 0 extrapolates and never waits.",
        ),
    ] = DEFAULT_WAIT
    loop_period: Annotated[
        float,
        Bounds(
            0.0,
            0.1,
            "s",
            "Period for which corrected samples are combined into one, instead of dropping some "
            "where a loop is slower than the sensor; 0 passes each on. Raw input only",
        ),
    ] = 0.0
    wheel_source: Annotated[
        WheelSource,
        Meaning(
            "Topic that shows how the wheels turn: `joint_states`, or `odometry` for the forward "
            "speed in nav_msgs/Odometry on `odom`, integrated and divided by `robot.wheel_radius`."
        ),
    ] = WheelSource.JOINT_STATES


def wheel_input(
    settings: InputSettings, radius: Callable[[], float]
) -> WheelDecoder | OdometryDecoder:
    """Return what decodes the messages of the topic that `settings` chooses.

    Args:
        settings: Of the inputs.
        radius: Returns that of the wheels [m].
    """
    if settings.wheel_source is WheelSource.ODOMETRY:
        return OdometryDecoder(radius, settings.wheel_gear_ratio, settings.stamps)
    return WheelDecoder(
        settings.left_wheel_joint,
        settings.right_wheel_joint,
        settings.wheel_gear_ratio,
        settings.stamps,
    )
