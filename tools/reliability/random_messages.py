"""Random messages for the nodes: wild numbers, stamps, names and lengths among sound ones.

`python tools/reliability/random_messages.py COUNT SEED` feeds them to the running nodes of a graph.
Later runs with the same seed send the same messages.
"""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Callable, Iterator
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TwistStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState, Temperature
from std_msgs.msg import Bool, Float64, Float64MultiArray

WILD = (
    0.0, -0.0, 1.0, -1.0, 5e-324, 1e-300, 1e9, 1e80, -1e80, 1e100, 1e154, -1e154, 1e300,
    math.nan, math.inf, -math.inf, sys.float_info.max,
)  # fmt: skip
SECONDS = (0, 1, -1, -(2**31), 2**31 - 1, 10**9, 1_700_000_000)
NANOSECONDS = (0, 1, 999_999_999, 10**9, 2**31, 2**32 - 1)
NAMES = (
    "left_wheel_joint", "right_wheel_joint", "wheel_joint", "tilt", "", "my-filter", "my filter",
    "1st", "/a//b", "ü", "x" * 300, "kalman", "~", "filter_node", "correction_node",
)  # fmt: skip
TOPICS: dict[str, type[Any]] = {
    "imu/data_raw": Imu,
    "imu/data_corrected": Imu,
    "imu/data": Imu,
    "imu/temperature": Temperature,
    "joint_states": JointState,
    "reference/joint_states": JointState,
    "tilt/compare": JointState,
    "tilt": Float64,
    "tilt/valid": Bool,
    "motor/command": Float64MultiArray,
    "cmd_vel": TwistStamped,
    "/clock": Clock,
    "/diagnostics": DiagnosticArray,
}
"""What is sent where."""


class RandomMessages:
    """Draws messages; the same for the same seed."""

    def __init__(self, seed: int) -> None:
        """Begin the sequence of this seed."""
        self._random = random.Random(seed)
        self.now = 1_700_000_000_000_000_000
        """Stamp of the latest message [ns], apart from wild ones."""

    def messages(self, count: int) -> Iterator[tuple[str, Any]]:
        """Yield topics and messages."""
        for _ in range(count):
            topic = self._random.choice(tuple(TOPICS))
            yield topic, self.message(TOPICS[topic])

    def message(self, kind: type[Any]) -> Any:
        """Return a message of this type."""
        fill: dict[type[Any], Callable[[Any], None]] = {
            Imu: self._imu,
            JointState: self._joints,
            Float64: self._number,
            Bool: self._bool,
            Float64MultiArray: self._numbers,
            TwistStamped: self._twist,
            Clock: self._clock,
            Temperature: self._temperature,
            DiagnosticArray: self._diagnostics,
        }
        message = kind()
        fill[kind](message)
        return message

    def _value(self) -> float:
        if self._random.random() < 0.1:
            return self._random.choice(WILD)
        return self._random.gauss(0.0, 10.0 ** self._random.uniform(-3, 2))

    def _stamp(self, stamp: Any) -> None:
        self.now += self._random.randrange(10_000_000)
        stamp.sec, stamp.nanosec = divmod(self.now, 10**9)
        if self._random.random() < 0.1:
            stamp.sec = self._random.choice(SECONDS)
            stamp.nanosec = self._random.choice(NANOSECONDS)

    def _imu(self, message: Imu) -> None:
        self._stamp(message.header.stamp)
        for vector in (message.angular_velocity, message.linear_acceleration):
            vector.x, vector.y, vector.z = self._value(), self._value(), self._value()
        turn = message.orientation
        if self._random.random() < 0.5:
            turn.x, turn.y, turn.z, turn.w = (self._value() for _ in range(4))
        for name in ("orientation", "angular_velocity", "linear_acceleration"):
            if self._random.random() < 0.5:
                setattr(message, f"{name}_covariance", [self._value() for _ in range(9)])
        if self._random.random() < 0.3:
            message.orientation_covariance[0] = -1.0

    def _joints(self, message: JointState) -> None:
        self._stamp(message.header.stamp)
        message.name = [self._random.choice(NAMES) for _ in range(self._random.randrange(5))]
        message.position = [self._value() for _ in range(self._random.randrange(5))]
        message.velocity = [self._value() for _ in range(self._random.randrange(5))]

    def _number(self, message: Float64) -> None:
        message.data = self._value()

    def _bool(self, message: Bool) -> None:
        message.data = self._random.random() < 0.5

    def _numbers(self, message: Float64MultiArray) -> None:
        message.data = [self._value() for _ in range(self._random.randrange(5))]

    def _twist(self, message: TwistStamped) -> None:
        self._stamp(message.header.stamp)
        message.twist.linear.x, message.twist.angular.z = self._value(), self._value()

    def _clock(self, message: Clock) -> None:
        self._stamp(message.clock)

    def _temperature(self, message: Temperature) -> None:
        self._stamp(message.header.stamp)
        message.temperature = self._value()

    def _diagnostics(self, message: DiagnosticArray) -> None:
        self._stamp(message.header.stamp)
        draw = self._random
        values = [KeyValue(key=draw.choice(NAMES), value=str(self._value()))]
        message.status = [
            DiagnosticStatus(
                level=bytes([draw.randrange(6)]),
                name=draw.choice(NAMES),
                message=draw.choice(NAMES),
                values=values * draw.randrange(3),
            )
            for _ in range(draw.randrange(3))
        ]

    def spoiled(self, data: bytes) -> bytes:
        """Return a serialised message, one in twenty cut, lengthened or with bytes changed."""
        draw = self._random
        if draw.random() > 0.05:
            return data
        kind = draw.randrange(3)
        if kind == 0:
            return data[: draw.randrange(len(data))]
        if kind == 1:
            return data + draw.randbytes(draw.randrange(64))
        changed = bytearray(data)
        for _ in range(draw.randint(1, 4)):
            changed[draw.randrange(len(changed))] = draw.randrange(256)
        return bytes(changed)


def main() -> None:
    """Feed a graph, and say at the end how many messages went out."""
    import time

    import rclpy

    count, seed = int(sys.argv[1]), int(sys.argv[2])
    rclpy.init()
    node = rclpy.create_node("random_messages")
    publishers = {topic: node.create_publisher(kind, topic, 100) for topic, kind in TOPICS.items()}
    for index, (topic, message) in enumerate(RandomMessages(seed).messages(count)):
        publishers[topic].publish(message)
        if index % 20 == 0:
            time.sleep(0.001)  # best-effort queues lose the rest
    print(f"{count} messages of seed {seed} sent")
    rclpy.shutdown()


if __name__ == "__main__":
    main()
