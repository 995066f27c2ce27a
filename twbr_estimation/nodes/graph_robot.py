"""One robot in the graph, as the web page shows it: topics, diagnostics, parameters, services."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from ..dashboard.source import ParameterInfo, ShownOutcome, ShownRobot, Source, Status, StreamRate
from ..dashboard.state import RANK, SILENT_AFTER, name_within, state_in_words
from ..dashboard.telemetry import ACTIVE, Telemetry
from ..errors import TwbrError
from ..ros_messages import ORIENTATION, ORIENTATION_COVARIANCE, tilt_of_quaternion
from ..samples import SINGLE_WHEEL_JOINT
from ..streams.messages import JointStateDecoder, decode_imu, decode_raw_imu
from .graph_recorder import GraphRecorder
from .graph_requests import Requests
from .qos import latched
from .sampled_topic import SampledTopic, Turns

LEVELS = {
    DiagnosticStatus.OK: "OK",
    DiagnosticStatus.WARN: "WARN",
    DiagnosticStatus.ERROR: "ERROR",
    DiagnosticStatus.STALE: "STALE",
}
SILENCE = 1.0
"""A tilt older than this is stale [s]."""
ENCAPSULATION = 4
"""Bytes of a serialised message before its content."""
DRAWN_ON_REQUEST = {"raw": "imu/data_raw", "corrected": "imu/data_corrected"}
"""Topics by the trace that needs them; they are fast, and cost most of what the page costs."""
WHEELS = ("left_wheel_joint", "right_wheel_joint", SINGLE_WHEEL_JOINT)
PUSH = 3.0
"""Force of a push on the simulated robot [N]."""
TRIGGERS = {
    "calibrate": "correction_node/calibrate",
    "reset filters": "filter_node/reset",
    "stand up": "simulator_node/stand_up",
}


class GraphRobot(Source):
    """Connects the page to the nodes of one namespace."""

    live = True
    on_request = tuple(DRAWN_ON_REQUEST)

    def __init__(self, node: Node, taker: Node, namespace: str, folder: str) -> None:
        """Prepare; nothing fast is received until `open`.

        Args:
            node: Node of the page, spun by an executor.
            taker: Node whose subscriptions no executor serves.
            namespace: Of the robot's nodes; empty for that of `node`.
            folder: Folder for recordings.
        """
        self._space = f"/{namespace.strip('/')}" if namespace else node.get_namespace()
        self._space = self._space.rstrip("/")
        self.name = self._space.lstrip("/") or "robot"
        self.telemetry = Telemetry()
        self._node, self._taker = node, taker
        self._statuses: dict[str, tuple[float, Status]] = {}
        self._topics: list[SampledTopic] = []
        self._turns = Turns(())
        self._wanted: frozenset[str] = frozenset()
        self._valid: bool | None = None
        self._decoders: dict[str, JointStateDecoder] = {}
        self._compare: tuple[str, ...] = ()
        self._requests = Requests(node, self._space)
        self._recorder = GraphRecorder(node, self._space, folder, self._requests)
        self._drive = node.create_publisher(TwistStamped, f"{self._space}/cmd_vel", 10)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 50)

    # What arrives

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        now = time.monotonic()
        for status in message.status:
            name = name_within(self._space, status.name)
            if name is None:
                continue
            values = {item.key: item.value for item in status.values}
            level = LEVELS.get(status.level, "STALE")
            self._statuses[name] = (now, Status(name, level, status.message, values))

    def _on_valid(self, data: bytes) -> None:
        self._valid = data[ENCAPSULATION:] != b"\0"

    def open(self) -> None:
        """Subscribe to the fast topics."""
        if self._topics:
            return
        self._topics = [
            self._sampled("reference/joint_states", JointState, 32, self._on_reference),
            self._sampled("imu/data", Imu, 1, self._on_imu),
            self._sampled("tilt/compare", JointState, 1, self._on_compare),
            self._sampled("joint_states", JointState, 1, self._on_wheels),
            self._sampled("tilt/valid", Bool, 1, self._on_valid, latched()),
        ]
        for topic in self._topics:
            topic.begin()
        others = [
            self._sampled("imu/data_raw", Imu, 1, self._on_raw),
            self._sampled("imu/data_corrected", Imu, 1, self._on_corrected),
            self._sampled("motor/command", Float64MultiArray, 1, lambda data: None),
        ]
        self._topics += others
        self._turns = Turns(others)

    def _sampled(
        self,
        topic: str,
        kind: Any,
        depth: int,
        handle: Callable[[bytes], None],
        quality: QoSProfile | None = None,
    ) -> SampledTopic:
        name = f"{self._space}/{topic}"
        return SampledTopic(self._taker, name, kind, depth, handle, quality)

    def close(self) -> None:
        """Leave the fast topics."""
        for topic in self._topics:
            topic.end()
        self._topics = []

    def want(self, traces: Collection[str]) -> None:
        """Draw these traces of those that are not always drawn."""
        self._wanted = frozenset(traces)

    def poll(self) -> None:
        """Take what has arrived."""
        wanted = {f"{self._space}/{DRAWN_ON_REQUEST[name]}" for name in self._wanted}
        self._turns.go_on(time.monotonic(), wanted)
        for topic in self._topics:
            topic.take()

    def _decoded(self, topic: str, data: bytes) -> tuple[int, dict[str, float]]:
        decoder = self._decoders.setdefault(topic, JointStateDecoder())
        stamp, names, positions = decoder.decode(data)[:3]
        return stamp, dict(zip(names, positions, strict=False))

    def _on_reference(self, data: bytes) -> None:
        stamp, joints = self._decoded("reference", data)
        for tilt in list(joints.values())[:1]:
            self.telemetry.add_reference(stamp, tilt)

    def _on_imu(self, data: bytes) -> None:
        stamp, values = decode_imu(data)
        x, y, z, w = values[ORIENTATION : ORIENTATION + 4]
        if not math.isfinite(x + y + z + w):
            self.telemetry.not_finite += 1
            return
        variance = values[ORIENTATION_COVARIANCE + 4]
        self.telemetry.pose.roll = math.asin(max(-1.0, min(1.0, 2.0 * (y * z + w * x))))
        tilt = tilt_of_quaternion(x, y, z, w)
        self.telemetry.add_estimate(ACTIVE, stamp, tilt, max(variance, 0.0))

    def _on_compare(self, data: bytes) -> None:
        stamp, joints = self._decoded("compare", data)
        for name, tilt in joints.items():
            self.telemetry.add_estimate(name, stamp, tilt)

    def _on_corrected(self, data: bytes) -> None:
        stamp, values = decode_imu(data)
        if "corrected" in self._wanted and values[ORIENTATION_COVARIANCE] >= 0.0:
            tilt = tilt_of_quaternion(*values[ORIENTATION : ORIENTATION + 4])
            self.telemetry.add_angle("corrected", stamp, tilt)

    def _on_raw(self, data: bytes) -> None:
        stamp, values = decode_raw_imu(data)
        if "raw" in self._wanted:
            self.telemetry.add_angle("raw", stamp, math.atan2(-values[3], values[5]))

    def _on_wheels(self, data: bytes) -> None:
        _, joints = self._decoded("wheels", data)
        turned = [joints[name] for name in WHEELS if name in joints] or list(joints.values())[:2]
        pose, size = self.telemetry.pose, self.geometry()
        tilt = 0.0 if math.isnan(pose.tilt) else pose.tilt
        pose.wheel = sum(turned) / max(len(turned), 1) + tilt
        if len(turned) == 2:
            pose.heading = size.wheel_radius * (turned[1] - turned[0]) / size.track_width

    # What is known

    def geometry(self) -> ShownRobot:
        """Return the dimensions of the robot that the nodes are configured for."""
        return self._requests.geometry

    def statuses(self) -> Sequence[Status]:
        """Return the latest diagnostics by node, the worst first; silent nodes are stale."""
        now, found = time.monotonic(), []
        for received, each in tuple(self._statuses.values()):
            age = now - received
            level, message = each.level, each.message
            if age > SILENT_AFTER:
                level, message = "STALE", f"silent for {age:.0f} s; last: {each.message}"
            found.append(Status(each.name, level, message, each.values, age))
        return sorted(found, key=lambda each: (-RANK.index(each.level), each.name))

    def words(self) -> tuple[str, str]:
        """Return the robot's state in words, and its level."""
        ages = {topic.name: topic.age() for topic in self._topics}
        silent = bool(ages) and ages.get(f"{self._space}/imu/data", math.inf) > SILENCE
        return state_in_words(self.statuses(), silent, self._valid)

    def rates(self) -> Sequence[StreamRate]:
        """Return how the topics arrive."""
        return [
            StreamRate(
                topic.name.removeprefix(f"{self._space}/"),
                topic.rate(),
                topic.age(),
                topic.longest,
                topic.unreadable,
            )
            for topic in self._topics
        ]

    # What is asked for

    def nodes(self) -> Sequence[str]:
        """Return the nodes of the robot that are in the graph."""
        return self._requests.nodes()

    def revision(self, node: str) -> int:
        """Return a number that changes with the parameters of a node."""
        return self._requests.revision(node)

    async def parameters(self, node: str) -> Sequence[ParameterInfo]:
        """Return the parameters of a node.

        Raises:
            TwbrError: the node does not answer.
        """
        return await self._requests.parameters(node)

    async def set_parameter(self, node: str, name: str, value: Any) -> ShownOutcome:
        """Change a parameter; the outcome has the node's reason where it refuses."""
        return await self._requests.set_parameter(node, name, value)

    def actions(self) -> Sequence[str]:
        """Return what can be done now."""
        found = [name for name, service in TRIGGERS.items() if self._ready(Trigger, service)]
        if self._ready(SetBool, "controller_node/enable"):
            found += ["enable", "disable"]
        if self._ready(Trigger, "simulator_node/push"):
            found += ["push back", "push forward"]
        return [*found, "stop recording" if self._recorder.running else "record"]

    def _ready(self, kind: Any, service: str) -> bool:
        return self._requests.is_ready(kind, service)

    async def act(self, action: str) -> ShownOutcome:
        """Call a service, or start and stop the recorder."""
        try:
            if action in TRIGGERS:
                return await self._requests.call(Trigger, TRIGGERS[action], Trigger.Request())
            if action in ("enable", "disable"):
                request = SetBool.Request(data=action == "enable")
                return await self._requests.call(SetBool, "controller_node/enable", request)
            if action in ("push back", "push forward"):
                return await self._push(PUSH if action == "push forward" else -PUSH)
            if action == "record":
                return ShownOutcome(True, f"recording into {await self._recorder.start()}")
            if action == "stop recording":
                return ShownOutcome(True, self._recorder.stop())
        except (TwbrError, OSError) as error:
            return ShownOutcome(False, str(error))
        return ShownOutcome(False, f"{action!r} is not known")

    async def _push(self, force: float) -> ShownOutcome:
        outcome = await self._requests.set_parameter("simulator_node", "push_force", force)
        if not outcome.done:
            return outcome
        return await self._requests.call(Trigger, "simulator_node/push", Trigger.Request())

    def drive(self, speed: float, yaw_rate: float) -> None:
        """Publish a velocity command."""
        message = TwistStamped()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.twist.linear.x, message.twist.angular.z = float(speed), float(yaw_rate)
        self._drive.publish(message)

    def seek(self, time: float) -> None:
        """Ignore; a live robot has no other time."""

    def position(self) -> float:
        """Return 0: live."""
        return 0.0

    def duration(self) -> float:
        """Return 0: live."""
        return 0.0

    def end(self) -> None:
        """Finish a recording and leave the graph."""
        if self._recorder.running:
            self._recorder.stop()
        self.close()
