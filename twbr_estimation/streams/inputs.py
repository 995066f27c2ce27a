"""Inputs of a node: topic names, waiting times, and messages about missing inputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..pipeline.pairing import DEFAULT_WAIT
from .device.stamping import Stamps


@dataclass(frozen=True, slots=True)
class InputSettings:
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
            "Clock that stamps raw Imu messages and `joint_states`: `header`, the sender's, "
            "must be set to that of this computer; `arrival`, the time at which a message "
            "comes; `device`, the sender's own clock, such as the time since it was switched "
            "on, related to ours. See "
            "docs/microcontroller.md."
        ),
    ] = Stamps.HEADER
    wheel_gear_ratio: Annotated[
        float,
        Bounds(
            0.001,
            1000.0,
            "",
            "Turns of the joints to one turn of the wheels: that of the gear where "
            "`joint_states` counts turns of the motors",
        ),
    ] = 1.0

    def __post_init__(self) -> None:
        require_bounds(self)
