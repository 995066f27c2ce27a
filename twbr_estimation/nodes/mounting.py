"""The IMU's mounting from a URDF, or from the transforms of `/tf_static` once they are there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..configuration.frames import Mounting, Transform, mounted, of_quaternion, urdf_frames
from ..errors import TwbrError
from ..parameters.bounds import Meaning
from ..robot import Robot
from .parameters import declare_settings
from .qos import latched


@dataclass(frozen=True, slots=True)
class MountingFrames:
    """Frames that say how the IMU sits in the robot."""

    body_frame: Annotated[
        str,
        Meaning(
            "Frame of the body, x forward, y left, z up: robot.mounting is then taken from "
            "mounting.urdf_file, or from /tf_static; as configured if empty."
        ),
    ] = ""
    urdf_file: Annotated[
        str, Meaning("URDF that holds the frames; /tf_static counts if empty.")
    ] = ""
    sensor_frame: Annotated[str, Meaning("Frame of the IMU's axes.")] = "imu_link"
    axle_frame: Annotated[
        str,
        Meaning(
            "Frame in the middle of the axle: robot.lever_arm is then taken from the frames, "
            "too; as configured if empty."
        ),
    ] = ""


class MountingFromFrames:
    """Sets the parameters `robot.mounting` and `robot.lever_arm` of a node."""

    def __init__(self, node: Node, robot: Callable[[], Robot]) -> None:
        """Declare the frames' names and listen where a body frame is given.

        Args:
            node: The node whose parameters are set.
            robot: Returns the robot in force.

        Raises:
            ConfigurationError: a URDF that cannot be used.
        """
        names = declare_settings(node, MountingFrames(), "mounting.")
        self._node, self._robot = node, robot
        self._names = Mounting(names.body_frame, names.sensor_frame, names.axle_frame)
        self._frames: dict[str, Transform] = {}
        self.problem = ""
        """Why the mounting is not known yet; empty where it is."""
        if not self._names.body:
            return
        if names.urdf_file:
            path = Path(names.urdf_file).expanduser()
            self._use(mounted(robot(), urdf_frames(path), self._names), str(path))
        else:
            self._listen()

    def _listen(self) -> None:
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            self.problem = (
                "robot.mounting as configured: tf2_msgs is not installed, so /tf_static cannot be "
                "read; give mounting.urdf_file"
            )
            self._node.get_logger().error(self.problem)
            return
        self.problem = (
            f"robot.mounting as configured: /tf_static has not connected {self._names.sensor} "
            f"to {self._names.body} yet"
        )
        self._node.create_subscription(TFMessage, "/tf_static", self.take, latched())

    def take(self, message: Any) -> None:
        """Take a `tf2_msgs/TFMessage`."""
        try:
            for each in message.transforms:
                origin, turn = each.transform.translation, each.transform.rotation
                self._frames[each.child_frame_id] = Transform(
                    each.header.frame_id,
                    each.child_frame_id,
                    of_quaternion(turn.x, turn.y, turn.z, turn.w),
                    np.array([origin.x, origin.y, origin.z]),
                )
            found = mounted(self._robot(), self._frames.values(), self._names)
            self._use(found, "/tf_static")
        except TwbrError as error:
            self.problem = f"robot.mounting as configured: /tf_static: {error}"
            return
        self.problem = ""

    def _use(self, robot: Robot, source: str) -> None:
        former = self._robot()
        if (robot.mounting, robot.lever_arm) == (former.mounting, former.lever_arm):
            return
        values = {"robot.mounting": robot.mounting, "robot.lever_arm": robot.lever_arm}
        changes = [Parameter(name, value=list(value)) for name, value in values.items()]
        result = self._node.set_parameters_atomically(changes)
        if not result.successful:
            raise TwbrError(result.reason)
        shown = ", ".join(f"{name} {list(value)}" for name, value in values.items())
        self._node.get_logger().info(f"from {source}: {shown}")
