"""Which topics and joints of a bag hold what."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields

from ..errors import ConfigurationError
from ..parameters.argument_checks import elements_of, require_kind, shown
from ..samples import Stamps

IMU = "sensor_msgs/msg/Imu"
JOINT_STATE = "sensor_msgs/msg/JointState"
ODOMETRY = "nav_msgs/msg/Odometry"
TEMPERATURE = "sensor_msgs/msg/Temperature"
FLOAT64 = "std_msgs/msg/Float64"
FLOAT64_ARRAY = "std_msgs/msg/Float64MultiArray"


@dataclass(frozen=True, slots=True)
class TopicNames:
    """Topics and joints of a recording; names without a leading slash get one.

    Raises:
        ConfigurationError: a name that is no text, or not one or two different wheel joints.
    """

    imu: str = "/imu/data_raw"
    """`sensor_msgs/Imu` as the device reports it; required."""
    joint_states: str = "/joint_states"
    """`sensor_msgs/JointState` with the wheel joints, or `nav_msgs/Odometry` in their place."""
    wheel_joints: tuple[str, ...] = ("left_wheel_joint", "right_wheel_joint")
    """One wheel joint, or two as left, right."""
    reference: str = "/reference/joint_states"
    """Reference tilt: JointState, Imu (its orientation) or Float64 [rad]."""
    reference_joint: str = "tilt"
    """Joint of `reference` and `truth` where they are JointStates."""
    truth: str = "/truth/joint_states"
    """True tilt of a simulation."""
    temperature: str = "/imu/temperature"
    """`sensor_msgs/Temperature` of the IMU."""
    motors: str = "/motor/command"
    """`std_msgs/Float64MultiArray` with the voltage [V] of both motors, or of left and right."""
    stamps: Stamps = Stamps.HEADER
    """Which clock stamps the messages of IMU, wheels and temperature; see `restamping`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "stamps", _stamps(self.stamps))
        for role in ROLES:
            require_kind(f"topics.{role}", getattr(self, role), str, "the name of a topic")
            object.__setattr__(self, role, absolute(getattr(self, role)))
        require_kind("topics.reference_joint", self.reference_joint, str, "the name of a joint")
        joints = elements_of(self.wheel_joints) or (self.wheel_joints,)
        for joint in joints:
            require_kind("topics.wheel_joints", joint, str, "the name of a joint")
        object.__setattr__(self, "wheel_joints", joints)
        if len(joints) not in (1, 2) or len(set(joints)) < len(joints) or "" in joints:
            raise ConfigurationError(
                f"wheel joints {','.join(joints)!r}: one name, or two as left,right, "
                "are needed (`topics.wheel_joints`)"
            )

    def is_default(self, role: str) -> bool:
        """Return whether the topic of `role` is the one a recording of ours has."""
        return bool(getattr(self, role) == _DEFAULTS[role])


ROLES = ("imu", "joint_states", "reference", "truth", "temperature", "motors")
"""Fields of `TopicNames` that are topics."""

_DEFAULTS = {field.name: field.default for field in fields(TopicNames)}


def _stamps(given: object) -> Stamps:
    """Return which clock is meant by a member of `Stamps` or its value."""
    try:
        return Stamps(given)
    except ValueError:
        known = ", ".join(each.value for each in Stamps)
        raise ConfigurationError(
            f"{shown(given)} is no clock; there are: {known} (`topics.stamps`)"
        ) from None


def absolute(name: str) -> str:
    """Return a topic name with its leading slash."""
    return name if not name or name.startswith("/") else f"/{name}"


def full_type(name: str) -> str:
    """Return a message type in its form of today: `sensor_msgs/Imu` as `sensor_msgs/msg/Imu`.

    Names of DDS (`sensor_msgs::msg::dds_::Imu_`) and of Python (`sensor_msgs.msg.Imu`,
    `sensor_msgs.msg._imu.Imu`) count.
    """
    words = re.split(r"::|[/.]", name.strip().strip("/"))
    parts = [word for word in words if word.lower() not in ("msg", "dds_") and word[:1] != "_"]
    if len(parts) != 2 or not all(parts):
        return name
    package, kind = parts
    return f"{package}/msg/{kind.removesuffix('_')}"
