"""Record the topics of one robot into a recording that `twbr evaluate` reads."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState, Temperature
from std_msgs.msg import Float64MultiArray

from ..configuration.files import write_section
from ..configuration.of_recording import CONFIG_FOLDER
from ..errors import TwbrError
from ..printing.text import counted
from ..robot import Calibration, Robot
from .declarations import settings_from
from .graph_requests import Requests

if TYPE_CHECKING:
    from ..bags.recorder import BagRecorder

TOPICS = {
    "imu/data_raw": Imu,
    "joint_states": JointState,
    "reference/joint_states": JointState,
    "imu/temperature": Temperature,
    "motor/command": Float64MultiArray,
    "imu/data": Imu,
}
DEPTH = 1000
DESCRIBED_BY = ("correction_node", "filter_node")
"""Nodes whose parameters describe the robot, in the order they are asked."""


class GraphRecorder:
    """Starts and stops recordings; the folder `config` in them describes the robot."""

    def __init__(self, node: Node, space: str, folder: str, requests: Requests) -> None:
        """Record the topics of the namespace `space` into sub-folders of `folder`."""
        self._node, self._space, self._folder = node, space, Path(folder).expanduser()
        self._requests = requests
        self._recorder: BagRecorder | None = None
        self._starting = False
        self._subscriptions: list[Any] = []
        self._target = Path()

    @property
    def running(self) -> bool:
        """Whether a recording is being made, or about to be."""
        return self._recorder is not None or self._starting

    async def start(self) -> Path:
        """Begin a recording and return its folder.

        Raises:
            TwbrError: the folder cannot be written, or a recording is running.
        """
        if self.running:
            raise TwbrError(f"{self._target}: is being recorded; stop it first")
        self._starting = True  # before anything is awaited: two browsers may ask at once
        try:
            robot, calibration = await self._described()
            self._begin(robot, calibration)
        finally:
            self._starting = False
        return self._target

    def _begin(self, robot: Robot, calibration: Calibration) -> None:
        from ..bags.recorder import BagRecorder  # loads the readers of recordings, which is slow

        self._target = self._folder / self._name()
        types = {f"/{topic}": _type_name(kind) for topic, kind in TOPICS.items()}
        recorder = BagRecorder(self._target, types)
        for each in recorder.recovered:
            self._node.get_logger().warning(f"{each}: kept; its recorder did not end it")
        config = recorder.folder / CONFIG_FOLDER
        config.mkdir()
        write_section(config / "robot.yaml", robot)
        write_section(config / "calibration.yaml", calibration)
        self._recorder = recorder
        quality = QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._subscriptions = [
            self._node.create_subscription(
                kind, f"{self._space}/{topic}", self._writing(recorder, topic), quality, raw=True
            )
            for topic, kind in TOPICS.items()
        ]

    def _name(self) -> str:
        """Return a name after the time and the robot; robots may begin in the same second."""
        robot = self._space.strip("/").replace("/", "_")
        return f"{datetime.now():%Y-%m-%d_%H-%M-%S}{'_' if robot else ''}{robot}"

    def _writing(self, recorder: BagRecorder, topic: str) -> Callable[[bytes], None]:
        clock = self._node.get_clock()
        return lambda data: recorder.add(f"/{topic}", clock.now().nanoseconds, data)

    async def _described(self) -> tuple[Robot, Calibration]:
        """Return the robot as a node is configured for it; the defaults where none is there."""
        for name in DESCRIBED_BY:
            if name in self._requests.nodes():
                found = await self._requests.parameters(name)
                values = {each.name: each.value for each in found}
                robot = settings_from(Robot(), values, "robot.")
                return robot, settings_from(Calibration(), values, "calibration.")
        return Robot(), Calibration()

    def stop(self) -> str:
        """End the recording and return what was recorded.

        Raises:
            TwbrError: it could not be written.
        """
        recorder, self._recorder = self._recorder, None
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions = []
        if recorder is None:
            return "nothing was being recorded"
        recorder.close()
        return f"{self._target}: {counted(recorder.messages, 'message')}"


def _type_name(kind: Any) -> str:
    package = kind.__module__.partition(".")[0]
    return f"{package}/msg/{kind.__name__}"
