"""The evaluator on real middleware: figures of known errors, topics, JSON."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, Header, String
from std_srvs.srv import Trigger

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.nodes.estimator_inputs import FLOAT64
from twbr_estimation.nodes.evaluator_node import FIGURE_TOPICS, MOST_ESTIMATORS, EvaluatorNode
from twbr_estimation.ros_messages import set_stamp, set_tilt

TOPICS = ("imu/data", "tilt/compare", "reference/joint_states", "other/imu", "their/joints")
PERIOD = 2_000_000
START = 5_000_000_000


class Source:
    """Publishes a moving reference and estimates with known errors."""

    def __init__(self, graph: Any) -> None:
        create = graph.probe.create_publisher
        self._graph = graph
        self.reference = create(JointState, "reference/joint_states", 1000)
        self._compare = create(JointState, "tilt/compare", 1000)
        self.imus = {name: create(Imu, name, 1000) for name in ("imu/data", "other/imu")}

    def joints(self, publisher: Any, stamp: int, **positions: float) -> None:
        message = JointState(name=list(positions), position=list(positions.values()))
        set_stamp(message, stamp)
        publisher.publish(message)

    def imu(self, topic: str, stamp: int, tilt: float) -> None:
        message = Imu()
        set_stamp(message, stamp)
        set_tilt(message.orientation, tilt)
        self.imus[topic].publish(message)

    def publish(self, index: int, error: float, start: int = START) -> None:
        """Publish one instant; the error [rad] is that of `imu/data`."""
        stamp = start + PERIOD * index
        tilt = 0.2 * math.sin(0.01 * index)
        self.joints(self.reference, stamp, tilt=tilt)
        self.joints(self._compare, stamp, exact=tilt, high=tilt + math.radians(1.0))
        self.imu("imu/data", stamp, tilt + error)
        self.imu("other/imu", stamp, tilt - 2.0 * error)
        self._graph.executor.spin_once(timeout_sec=0.0)


def evaluator(graph: Any, **parameters: Any) -> EvaluatorNode:
    lossless = graph.lossless(*TOPICS)
    return graph.add(EvaluatorNode(**graph.options(**lossless, **parameters)))


def received(node: EvaluatorNode) -> int:
    node.publish_figures()
    values = node.report().values
    return min((count for name, count in values.items() if name.endswith(".samples")), default=0)


def test_known_errors_come_back_as_figures_topics_and_json(graph: Any, tmp_path: Path) -> None:
    target = tmp_path / "scores.json"
    node = evaluator(
        graph,
        estimators=["active=imu/data", "other=/other/imu"],
        json_file=str(target),
        source="test",
    )
    source = Source(graph)
    topics = [f"/evaluator_node/active/{figure}" for figure in FIGURE_TOPICS]
    figures = {topic: graph.collect(Float64, topic) for topic in topics}
    graph.settle()
    for index in range(400):
        source.publish(index, math.radians(3.0 if index % 2 else -1.0))
    graph.spin_until(lambda: received(node) == 400)
    graph.spin_until(lambda: all(figures.values()))
    graph.spin_until(
        lambda: node.publish_figures() or figures[topics[0]][-1].data == pytest.approx(5.0)
    )
    (scores,) = node.finish()
    assert scores.source == "test" and scores.dt == pytest.approx(0.002)
    active = scores.estimators["active"]
    assert active.mse_deg2 == pytest.approx(5.0)
    assert active.bias_deg == pytest.approx(1.0)
    assert active.max_abs_deg == pytest.approx(3.0)
    assert scores.estimators["other"].bias_deg == pytest.approx(-2.0)
    assert scores.estimators["high"].mse_deg2 == pytest.approx(1.0)
    assert scores.estimators["exact"].mse_deg2 == pytest.approx(0.0, abs=1e-20)
    written = json.loads(target.read_text())
    assert written["mean"]["high"]["mse_deg2"] == pytest.approx(1.0)
    assert written["recordings"][0]["estimators"]["active"]["samples"] == 400


def test_progress_says_how_far_the_slowest_source_is(graph: Any) -> None:
    evaluator(graph)
    source = Source(graph)
    progress = graph.collect(Header, "/evaluator_node/progress")
    graph.settle()
    for index in range(100):
        source.publish(index, 0.0)

    def reached() -> list[int]:
        return [each.stamp.sec * 10**9 + each.stamp.nanosec for each in progress]

    graph.spin_until(lambda: reached()[-1:] == [START + 99 * PERIOD])
    assert len(progress) >= 15  # three sources, at least one message for every twenty
    assert reached() == sorted(reached())


def test_each_pass_of_a_loop_is_a_recording_of_its_own(graph: Any) -> None:
    node = evaluator(graph)
    source = Source(graph)
    graph.settle()
    for repetition in range(2):
        for index in range(1000):
            source.publish(index, math.radians(1.0 + repetition))
        graph.spin_until(lambda: received(node) == 1000)
    scores = node.finish()
    assert [round(each.estimators["active"].bias_deg, 6) for each in scores] == [1.0, 2.0]
    assert [each.estimators["active"].samples for each in scores] == [1000, 1000]


def test_messages_without_an_orientation_are_not_scored(graph: Any) -> None:
    node = evaluator(graph)
    source = Source(graph)
    graph.settle()
    for index in range(50):
        source.publish(index, 0.0)
    empty = Imu()
    empty.orientation_covariance[0] = -1.0
    set_stamp(empty, START + 50 * PERIOD)
    source.imus["imu/data"].publish(empty)
    graph.spin_until(lambda: node.report().values.get("active.not_used") == 1)
    assert received(node) == 50


def test_diagnostics_name_what_is_missing_and_then_the_best(graph: Any) -> None:
    node = evaluator(graph)
    heard = graph.collect(DiagnosticArray, "/diagnostics")
    assert "waiting for reference" in node.report().message
    source = Source(graph)
    graph.settle()
    for index in range(50):
        source.publish(index, math.radians(1.0))
    graph.spin_until(lambda: received(node) == 50)
    assert node.report().message.startswith("best: exact")
    graph.spin_until(lambda: bool(heard))
    assert graph.call(Trigger, "/evaluator_node/reset", Trigger.Request()).success
    assert "no estimate" in node.report().message


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        (["imu/data"], "NAME=TOPIC"),
        (["a b=imu/data"], "NAME=TOPIC"),
        (["=imu/data"], "NAME=TOPIC"),
        (["name="], "NAME=TOPIC"),
        (["a=b", "a=c"], "a stands twice"),
        (["a=b,sign=2"], "estimators: .*'sign=2' is not understood"),
    ],
)
def test_a_wrong_estimator_is_refused(graph: Any, entries: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        EvaluatorNode(**graph.options(estimators=entries))


@pytest.fixture
def peer(domain: int) -> Iterator[Any]:
    """A node of another participant: one that publishes what ours did not expect."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("peer", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def listening(node: EvaluatorNode, topic: str) -> Any:
    """Let the node look at the graph; return its input of that topic."""
    node.publish_figures()
    (found,) = [each for each in node._inputs if each.topic == topic]
    return found


def test_an_estimator_of_another_type_sign_and_unit_joins(graph: Any) -> None:
    """The topic's type is found out; a JointState and an Imu keep their stamps."""
    joint, imu = "wheel=/their/joints:pitch,sign=-1,unit=deg", "their=/other/imu,offset_deg=-2"
    node = evaluator(graph, estimators=[joint, imu, "plain=/other/imu"])
    source = Source(graph)
    joints = graph.probe.create_publisher(JointState, "their/joints", 1000)
    graph.settle()
    for index in range(100):
        tilt = 0.2 * math.sin(0.01 * index)
        source.publish(index, math.radians(-1.0))  # other/imu reads 2 deg too much
        their = -math.degrees(tilt) - 3.0
        source.joints(joints, START + PERIOD * index, knee=1.0, pitch=their)
        source.joints(joints, START + PERIOD * index, elbow=1.0)  # somebody else's
    graph.spin_until(lambda: received(node) == 100)
    values = node.report().values
    assert values["their.max_abs_deg"] == pytest.approx(0.0, abs=1e-9)
    assert values["plain.bias_deg"] == pytest.approx(2.0)
    assert values["wheel.bias_deg"] == pytest.approx(3.0)
    assert values["wheel.mse_deg2"] == pytest.approx(9.0)
    assert not [name for name in values if name.endswith(".not_used")]


def test_a_number_without_a_stamp_counts_from_its_arrival(graph: Any, peer: Any) -> None:
    """A reference that turns at 1 rad/s shows the delay of the stamps."""
    node = evaluator(graph, estimators=["theirs=/robot_pitch"])
    source, pitch = Source(graph), peer.create_publisher(Float64, "robot_pitch", 1000)
    begin = time.time_ns()

    def publish() -> None:
        now = time.time_ns()
        source.joints(source.reference, now, tilt=(now - begin) * 1e-9)
        pitch.publish(Float64(data=(now - begin) * 1e-9))

    graph.settle()
    graph.spin_until(lambda: listening(node, "/robot_pitch").kind == FLOAT64)
    graph.spin_until(lambda: pitch.get_subscription_count() == 1)
    theirs = listening(node, "/robot_pitch")
    for count in range(1, 51):
        publish()
        graph.spin_until(lambda count=count: theirs.received == count)
    publish()  # the reference must pass the last stamp
    graph.spin_until(lambda: received(node) >= 50)
    bias = node.report().values["theirs.bias_deg"]
    assert -math.degrees(0.05) < bias < 0.0  # late by up to 50 ms, never early


def test_a_simulated_clock_stamps_what_has_no_stamp(graph: Any, peer: Any) -> None:
    node = evaluator(graph, estimators=["theirs=/robot_pitch"], use_sim_time=True)
    pitch = peer.create_publisher(Float64, "robot_pitch", 1000)
    clock = graph.probe.create_publisher(Clock, "/clock", 10)
    source = Source(graph)
    graph.settle()
    graph.spin_until(lambda: listening(node, "/robot_pitch").kind == FLOAT64)
    theirs = listening(node, "/robot_pitch")
    graph.spin_until(lambda: pitch.get_subscription_count() == 1)
    for index in range(20):
        stamp = START + 10 * PERIOD * index
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(stamp, 10**9)
        clock.publish(message)
        graph.spin_until(lambda stamp=stamp: node.get_clock().now().nanoseconds == stamp)
        source.joints(source.reference, stamp, tilt=0.02 * index)
        pitch.publish(Float64(data=0.02 * index))
        graph.spin_until(lambda index=index: theirs.received == index + 1)
    graph.spin_until(lambda: received(node) == 20)
    assert node.report().values["theirs.max_abs_deg"] == pytest.approx(0.0, abs=1e-9)


def test_why_an_estimator_is_not_compared_is_reported(graph: Any, peer: Any) -> None:
    entries = ["text=/words", "stopped=/other/imu", "old=imu/data"]
    node = evaluator(graph, estimators=entries)
    words = peer.create_publisher(String, "words", 10)
    source = Source(graph)
    graph.settle()
    for index in range(50):
        stamp = START + PERIOD * index
        source.joints(source.reference, stamp, tilt=0.0)
        source.imu("other/imu", 0, 0.0)
        source.imu("imu/data", stamp - 3_000_000_000, 0.0)
    words.publish(String(data="upright"))
    graph.spin_until(lambda: listening(node, "/other/imu").without_stamp == 50)
    graph.spin_until(lambda: listening(node, "/imu/data").received == 50)
    graph.spin_until(lambda: bool(listening(node, "/words").problem))
    graph.spin_until(lambda: "/words" in node.report().message)
    said = node.report().message
    assert "/words is std_msgs/msg/String; needed is sensor_msgs/msg/Imu" in said
    assert "/other/imu: no message has a stamp" in said
    assert "old: its stamps are -3.000 s from the reference's" in said


def test_settings_are_fixed_once_it_runs(graph: Any) -> None:
    node = evaluator(graph)
    assert not node.set_parameters([Parameter("skip", value=1.0)])[0].successful


def test_a_run_without_data_ends_cleanly_and_says_so(graph: Any, python: str) -> None:
    program = "import sys; from twbr_estimation.nodes.evaluator_node import main; sys.exit(main())"
    process = subprocess.Popen(
        [python, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    graph.spin_until(lambda: bool(diagnostics), limit=60.0)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert "no estimate has been compared" in output + errors
    assert "Traceback" not in errors


@pytest.mark.parametrize("name", ["my-filter", "my filter", "1st", "a__b", "", "x" * 300, "ü/.."])
def test_any_joint_name_has_figures(graph: Any, peer: Any, name: str) -> None:
    node = graph.add(EvaluatorNode(**graph.options()))
    graph.settle()
    assert node._figure(name, "mse_deg2") is node._figure(name, "mse_deg2")


def test_the_number_of_estimators_is_bounded(graph: Any) -> None:
    node = graph.add(EvaluatorNode(**graph.options(**graph.lossless("tilt/compare"))))
    compare = graph.probe.create_publisher(JointState, "tilt/compare", 100)
    graph.settle()
    for first in range(0, 1000, 50):
        names = [f"joint{first + index}" for index in range(50)]
        message = JointState(name=names, position=[0.1] * 50)
        set_stamp(message, 10**9 + first)
        compare.publish(message)
    left_out = 1000 - (MOST_ESTIMATORS - 1)
    graph.spin_until(lambda: node.report().values["estimators_left_out"] == left_out)
