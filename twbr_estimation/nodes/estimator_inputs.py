"""Tilt topics of external estimators: Imu, JointState or Float64, by the publisher's type.

A topic is first listened to as Imu, or as JointState where a joint is named. While nothing
arrives, the graph is asked what the topic carries, and the subscription follows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from ..ros_messages import ORIENTATION, ORIENTATION_COVARIANCE, UNREPORTED, tilt_of_quaternion
from ..scoring.estimator_topics import EstimatorTopic
from ..streams.messages import JointStateDecoder, decode_float64, decode_imu
from .qos import listen

IMU, JOINT_STATE, FLOAT64 = (
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Float64",
)
KINDS: dict[str, Any] = {IMU: Imu, JOINT_STATE: JointState, FLOAT64: Float64}
"""Message types that hold a tilt."""

Take = Callable[[str, int, float], None]


def estimator_inputs(
    node: Node, estimators: Mapping[str, EstimatorTopic], default_joint: str, take: Take
) -> list[EstimatorInput]:
    """Subscribe to the topics of estimators, each topic once.

    Args:
        node: Who subscribes.
        estimators: Topic, joint, sign and offset by name.
        default_joint: Joint of a JointState where none is named.
        take: Called with name, stamp [ns] and tilt [rad]; the tilt is NaN where a message holds
            none. A Float64 has no stamp: it gets that of its arrival, by the node's clock.
    """
    topics: dict[str, dict[str, EstimatorTopic]] = {}
    for name, described in estimators.items():
        topics.setdefault(node.resolve_topic_name(described.topic), {})[name] = described
    return [
        EstimatorInput(node, topic, names, default_joint, take) for topic, names in topics.items()
    ]


class EstimatorInput:
    """The subscription to one topic, for one estimator or several readings of it."""

    def __init__(
        self,
        node: Node,
        topic: str,
        estimators: Mapping[str, EstimatorTopic],
        default_joint: str,
        take: Take,
    ) -> None:
        """Subscribe; the arguments are those of `estimator_inputs`."""
        self.received = self.without_stamp = 0
        self.problem = ""
        """Why nothing can be used; empty where all is well."""
        self.topic = topic
        self._node, self._take = node, take
        self._wanted = [
            (name, described, described.joint or default_joint)
            for name, described in estimators.items()
        ]
        self._joints = JointStateDecoder()
        self._subscription: Any = None
        named = any(described.joint for described in estimators.values())
        self._listen(JOINT_STATE if named else IMU)

    def look(self) -> None:
        """Subscribe to the type of the topic's publishers, if nothing has come yet."""
        self.problem = ""
        if self.received:
            if self.received == self.without_stamp:
                self.problem = f"{self.topic}: no message has a stamp"
            return
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        kinds = {each.topic_type for each in publishers}
        if self.kind in kinds or not kinds:
            return
        if not kinds & KINDS.keys():
            there = ", ".join(sorted(kinds))
            self.problem = f"{self.topic} is {there}; needed is {' or '.join(KINDS)}"
            return
        if self._subscription is not None:
            # The executor lets go of it at its next turn; until then the topic keeps its type.
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
        else:
            self._listen(min(kinds & KINDS.keys()))

    def _listen(self, kind: str) -> None:
        self.kind = kind
        """Type of the messages that are listened to."""
        read = {IMU: _imu, JOINT_STATE: self._joints.decode, FLOAT64: self._float64}[kind]

        def take(data: bytes) -> None:
            self.received += 1
            stamp, names, tilts = read(data)
            if stamp <= 0:
                self.without_stamp += 1
                return
            for name, described, joint in self._wanted:
                if kind != JOINT_STATE:
                    self._take(name, stamp, described.tilt(tilts[0]))
                elif joint in names:  # else it holds other joints
                    self._take(name, stamp, described.tilt(tilts[names.index(joint)]))

        self._subscription = listen(self._node, KINDS[kind], self.topic, take)

    def _float64(self, data: bytes) -> tuple[int, tuple[str, ...], tuple[float, ...]]:
        return self._node.get_clock().now().nanoseconds, (), (decode_float64(data),)


def _imu(data: bytes) -> tuple[int, tuple[str, ...], tuple[float, ...]]:
    stamp, values = decode_imu(data)
    x, y, z, w = values[ORIENTATION : ORIENTATION + 4]
    oriented = values[ORIENTATION_COVARIANCE] != UNREPORTED and (x, y, z, w) != (0, 0, 0, 0)
    return stamp, (), (float(tilt_of_quaternion(x, y, z, w)) if oriented else math.nan,)
