"""One process to be measured: a bare relay, our estimation, or an empty node."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from rclpy.node import Node

DEPTH = 1000
PARAMETERS = {
    "tilt_stddev": 0.02,
    "ins_odometer.wheel_noise": 0.002,
    "kalman.q1": 1e-5,
    "robot.wheel_radius": 0.04,
}
"""Parameters of `filter_node` that a bench sets, the relay's too: of the node, of the active
filter, of another one and of the robot."""


def relay() -> Node:
    """Return a node that passes on what it receives, with rclpy's usual messages."""
    from sensor_msgs.msg import Imu, JointState
    from std_msgs.msg import Float64

    node = Node("relay")
    for name, value in PARAMETERS.items():
        node.declare_parameter(name, value)
    tilt = node.create_publisher(Float64, "tilt", DEPTH)
    imu = node.create_publisher(Imu, "imu/data", DEPTH)
    value = Float64()

    def pass_on(message: Imu) -> None:
        value.data = message.angular_velocity.y
        tilt.publish(value)
        imu.publish(message)

    node.create_subscription(Imu, "imu/data_raw", pass_on, DEPTH)
    node.create_subscription(JointState, "joint_states", lambda message: None, DEPTH)
    return node


def raw_relay() -> Node:
    """Return the same relay on serialised messages: the least that Python can do."""
    from sensor_msgs.msg import Imu, JointState
    from std_msgs.msg import Float64

    node = Node("raw_relay")
    tilt = node.create_publisher(Float64, "tilt", DEPTH)
    imu = node.create_publisher(Imu, "imu/data", DEPTH)
    value = b"\0\1\0\0" + bytes(8)

    def pass_on(message: bytes) -> None:
        tilt.publish(value)
        imu.publish(message)

    node.create_subscription(Imu, "imu/data_raw", pass_on, DEPTH, raw=True)
    node.create_subscription(JointState, "joint_states", lambda message: None, DEPTH, raw=True)
    return node


def ours() -> Sequence[Node]:
    """Return correction and filter in one process."""
    from twbr_estimation.nodes.estimation_node import compose

    return compose()


def filter_node() -> Node:
    """Return the filter node, in a process that is started as that of its command."""
    from twbr_estimation.nodes.filter_node import FilterNode

    return FilterNode()


def empty() -> Node:
    """Return a node without anything."""
    return Node("empty")


SUBJECTS: dict[str, Callable[[], Node | Sequence[Node]]] = {
    each.__name__: each for each in (relay, raw_relay, ours, filter_node, empty)
}


def announced() -> Node | Sequence[Node]:
    """Create the subject and report it, to time the start."""
    created = SUBJECTS[sys.argv[1]]()
    print("ready", flush=True)
    return created


if __name__ == "__main__":
    from twbr_estimation.starting import start_node

    if sys.argv[1] == "filter_node":
        start_node()
    from twbr_estimation.nodes.spin import run

    sys.exit(run(announced))
