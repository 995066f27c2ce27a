"""Inputs of correction and filter: their common parameters and raw subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState

from ..live_code.providing import BackgroundSteps, background_steps
from ..streams import odometry, wheels
from ..streams.inputs import InputSettings, WheelSource
from .declarations import Declaration
from .message_types import message_type
from .parameters import declare
from .qos import listen

IMU_FRAME = Declaration(
    "frame_id", "imu_link", "Frame of the Imu messages that are published.", read_only=True
)

MACHINE_CODE = Declaration(
    "machine_code",
    True,
    "Whether correction and filters run as machine code where that has been prepared by "
    "`python -m twbr_estimation.live_code.precompile`; the numbers are the same.",
    read_only=True,
)


class MachineCode:
    """Hands a node its compiled steps once they are loaded, between two samples."""

    def __init__(self, node: Node, use: Callable[[BackgroundSteps], None]) -> None:
        """Declare the parameter `machine_code`; start loading.

        Args:
            node: The node.
            use: Called once, by `look`, where there are any.
        """
        self._node, self._use = node, use
        self._steps = background_steps() if declare(node, MACHINE_CODE) else None
        self.shown = "off" if self._steps is None else "loading"
        """What is prepared, or why nothing is used, in words."""

    def look(self) -> None:
        """Pass the steps on if they have come."""
        steps = self._steps
        if steps is not None and steps.ready:
            self._steps = None
            if steps.refusal:
                self._node.get_logger().warning(steps.refusal)
            self.shown = ", ".join(steps.names) or "not prepared"
            if steps.names:
                self._use(steps)


def listen_to_wheels(node: Node, settings: InputSettings, callback: Callable[[bytes], None]) -> Any:
    """Subscribe to the serialised messages of the topic that shows how the wheels turn.

    Raises:
        ConfigurationError: it is an odometry and nav_msgs is not installed.
    """
    if settings.wheel_source is WheelSource.ODOMETRY:
        return listen(node, message_type("nav_msgs/msg/Odometry"), odometry.TOPIC, callback)
    return listen(node, JointState, wheels.TOPIC, callback)
