"""The tilt as a transform on `/tf`, where the messages for it are installed."""

from __future__ import annotations

from rclpy.node import Node

from ..ros_messages import set_stamp, set_tilt
from .declarations import Declaration
from .parameters import declare
from .qos import DEPTH

DECLARATIONS = (
    Declaration("publish_tf", False, "Whether the tilt goes out on /tf.", read_only=True),
    Declaration("tf_parent", "base_footprint", "Frame that stays level.", read_only=True),
    Declaration("tf_child", "base_link", "Frame that tilts with the body.", read_only=True),
)


class TiltTransform:
    """Publishes parent to child, turned by the tilt about +y; warns where it cannot."""

    def __init__(self, node: Node) -> None:
        """Declare `publish_tf`, `tf_parent` and `tf_child`; publish where asked and possible."""
        wanted, parent, child = (declare(node, each) for each in DECLARATIONS)
        self.problem = ""
        """Why there is no transform although it was asked for; empty where all is well."""
        self._publisher = None
        if not wanted:
            return
        try:
            from geometry_msgs.msg import TransformStamped
            from tf2_msgs.msg import TFMessage
        except ImportError:
            self.problem = "publish_tf is set but tf2_msgs is not installed: no transform"
            node.get_logger().error(self.problem)
            return
        self._transform = TransformStamped(child_frame_id=child)
        self._transform.header.frame_id = parent
        self._message = TFMessage(transforms=[self._transform])
        self._publisher = node.create_publisher(TFMessage, "/tf", DEPTH)

    def publish(self, stamp: int, tilt: float) -> None:
        """Publish the transform of this stamp [ns] and tilt [rad], if there is a publisher."""
        if self._publisher is None:
            return
        set_stamp(self._transform, stamp)
        set_tilt(self._transform.transform.rotation, tilt)
        self._publisher.publish(self._message)
