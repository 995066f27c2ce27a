"""Fixtures for tests of real nodes: a ROS domain of their own, and a graph that is spun.

Tests count messages and wait for conditions; the time limits only end a failing test.
"""

from __future__ import annotations

import fcntl
import os
import random
import socket
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

try:
    import rclpy  # noqa: F401
except ImportError:  # no pytest.importorskip: in a conftest.py, pytest 7.4 ends everything with it
    collect_ignore_glob = ["*"]

    def pytest_terminal_summary(terminalreporter: Any) -> None:
        """Say that the tests of the nodes were left out."""
        terminalreporter.write_line("LEFT OUT test/nodes: needs ROS 2: pip install .[ros]")

    BareGraph: Any = object
else:
    from reliability.graph import Graph as BareGraph

QUEUE_DEPTH = 2000
"""Longer than anything a test publishes, so that nothing is lost to scheduling."""
HIGHEST_DOMAIN = 101
"""The last domain whose UDP ports lie below Linux's ephemeral ports."""


def _unused(domain: int) -> bool:
    """Whether no participant of any program holds the domain's discovery port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7400 + 250 * domain))
        except OSError:
            return False
    return True


@contextmanager
def reserved_domain() -> Iterator[int]:
    """Reserve an unused ROS domain; also set in the environment for child processes."""
    for candidate in random.sample(range(1, HIGHEST_DOMAIN + 1), HIGHEST_DOMAIN):
        with (Path(tempfile.gettempdir()) / f"ros_domain_{candidate}.lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            if _unused(candidate):
                with pytest.MonkeyPatch.context() as patch:
                    patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
                    patch.setenv("ROS_DOMAIN_ID", str(candidate))
                    yield candidate
                return
    pytest.fail(f"all {HIGHEST_DOMAIN} ROS domains are in use")


@pytest.fixture
def domain() -> Iterator[int]:
    """Reserve an unused ROS domain for one test."""
    with reserved_domain() as found:
        yield found


class Graph(BareGraph):
    """Nodes of one test in one context, spun by one executor in the test's thread."""

    def lossless(self, *subscribed: str, published: tuple[str, ...] = ()) -> dict[str, Any]:
        """Return parameters that make topics of a node reliable, with long queues."""
        found: dict[str, Any] = {}
        for topic in subscribed:
            found[f"qos_overrides./{topic}.subscription.reliability"] = "reliable"
            found[f"qos_overrides./{topic}.subscription.depth"] = QUEUE_DEPTH
        for topic in published:
            found[f"qos_overrides./{topic}.publisher.depth"] = QUEUE_DEPTH
        return found

    def settle(self) -> None:
        """Spin until all publishers and subscriptions of the graph are matched."""

        def settled() -> bool:
            publishers = [each for node in self.nodes for each in node.publishers]
            listeners = [each for node in self.nodes for each in node.subscriptions]
            wanted = {each.topic_name for each in listeners}
            return all(
                each.get_subscription_count()
                >= sum(other.topic_name == each.topic_name for other in listeners)
                for each in publishers
                if each.topic_name in wanted
            ) and all(
                each.get_publisher_count()
                >= sum(other.topic_name == each.topic_name for other in publishers)
                for each in listeners
            )

        self.spin_until(settled)

    def collect(self, kind: Any, topic: str, depth: int = 1000) -> list[Any]:
        """Subscribe reliably; the list grows as messages arrive."""
        received: list[Any] = []
        self.probe.create_subscription(kind, topic, received.append, depth)
        return received


@pytest.fixture
def graph(domain: int) -> Iterator[Graph]:
    """Yield an empty graph in a domain of its own."""
    created = Graph(domain)
    yield created
    created.close()


@pytest.fixture
def open_graph(domain: int) -> Callable[[], Graph]:
    """Return what opens empty graphs, one after the other; the test closes them."""
    return lambda: Graph(domain)


@pytest.fixture
def python() -> str:
    """Return the interpreter for child processes that run nodes."""
    os.environ.setdefault("PYTHONUNBUFFERED", "1")
    return sys.executable


class Sensors:
    """Publishes what the sensors of a robot would, reliably."""

    def __init__(self, graph: Graph, make_drive: Callable[..., Any]) -> None:
        from sensor_msgs.msg import Imu, JointState

        self._graph, self._make_drive = graph, make_drive
        create = graph.probe.create_publisher
        self._imu = create(Imu, "imu/data_raw", QUEUE_DEPTH)
        self._joints = create(JointState, "joint_states", QUEUE_DEPTH)
        self._corrected = create(Imu, "imu/data_corrected", QUEUE_DEPTH)

    def drive(self, count: int) -> Any:
        """Return the readings of a drive."""
        return self._make_drive(count=count)

    def imu(
        self,
        stamp: int,
        gyro: tuple[float, float, float] = (0.0, 0.0, 0.0),
        accel: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Publish one raw IMU reading and let the nodes work."""
        from sensor_msgs.msg import Imu

        message = Imu()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        message.orientation_covariance[0] = -1.0
        rate, force = message.angular_velocity, message.linear_acceleration
        rate.x, rate.y, rate.z = gyro
        force.x, force.y, force.z = accel
        self._imu.publish(message)
        self._graph.executor.spin_once(timeout_sec=0.0)

    def corrected(self, stamp: int, angle: float) -> None:
        """Publish one corrected sample of this angle [rad] and let the nodes work."""
        import math

        from sensor_msgs.msg import Imu

        message = Imu()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        message.orientation.y, message.orientation.w = math.sin(angle / 2), math.cos(angle / 2)
        message.orientation_covariance[4] = 0.01
        message.linear_acceleration.z = 9.81
        self._corrected.publish(message)
        self._graph.executor.spin_once(timeout_sec=0.0)

    def play(
        self, drive: Any, start: int = 0, stop: int | None = None, wheels: bool = True
    ) -> None:
        """Publish part of a drive in the order of its stamps and let the nodes work."""
        from sensor_msgs.msg import JointState

        stamps, gyro, accel = drive.imu_columns
        stop = len(stamps) if stop is None else stop
        end = stamps[stop] if stop < len(stamps) else 2**62
        angles = zip(drive.wheels.stamps.tolist(), drive.wheels.angle.tolist(), strict=True)
        turns = [each for each in angles if wheels and stamps[start] <= each[0] < end]
        for index in range(start, stop):
            self.imu(stamps[index], gyro[index], accel[index])
            following = stamps[index + 1] if index + 1 < stop else end
            while turns and turns[0][0] < following:
                stamp, angle = turns.pop(0)
                message = JointState(name=["left_wheel_joint", "right_wheel_joint"], position=angle)
                message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
                self._joints.publish(message)
                self._graph.executor.spin_once(timeout_sec=0.0)


@pytest.fixture
def sensors(graph: Graph, make_drive: Callable[..., Any]) -> Sensors:
    """Return the sensors of a robot in this graph."""
    return Sensors(graph, make_drive)
