"""Drivers, correction and filter in one process, for small computers.

The nodes keep their names, parameters, services and topics; what one hands to the next goes
by a direct call instead of the middleware.
"""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

from ..messages import joint_position, sample_of, stamp_of
from ..pipeline.pairing import wheel_reading
from .correction_node import CorrectionNode
from .declarations import Declaration
from .encoder_node import EncoderNode
from .filter_node import FilterNode
from .guard import GuardedNode
from .mpu6050_node import Mpu6050Node
from .parameters import declare
from .spin import run

DRIVERS = Declaration(
    "drivers",
    True,
    "Whether the sensors are read in this process; else from imu/data_raw and joint_states, for "
    "instance of a replay.",
    read_only=True,
)


def compose(**options: Any) -> list[Node]:
    """Return the connected nodes, each created with these options of `rclpy.node.Node`."""
    process = GuardedNode("estimation_node", **options)
    drivers = declare(process, DRIVERS)
    tilt = FilterNode(subscribe=False, **options)
    correction = CorrectionNode(tilt.take, subscribe=not drivers, **options)
    tilt.pass_motors = correction.take_motors
    nodes = [process, tilt, correction]
    if drivers:
        take = SensorListener(correction)
        nodes.append(Mpu6050Node(listener=take.imu, **options))
        nodes.append(EncoderNode(listener=take.joints, **options))
    return nodes


class SensorListener:
    """Hands the drivers' messages to the correction."""

    def __init__(self, correction: CorrectionNode) -> None:
        """`correction`: who gets them."""
        self._correction = correction

    def imu(self, message: Imu) -> None:
        """Take a raw reading."""
        self._correction.take_imu(stamp_of(message), sample_of(message)[1:7])

    def joints(self, message: JointState) -> None:
        """Take the wheels; other joints, such as a reference encoder's, are left alone."""
        found = (joint_position(message, name) for name in self._correction.wheel_joints)
        angles = [angle for angle in found if angle is not None]
        if angles:
            self._correction.take_wheels(wheel_reading(stamp_of(message), angles))


def main(arguments: list[str] | None = None) -> int:
    """Run the nodes until they are asked to stop."""
    return run(compose, arguments)
