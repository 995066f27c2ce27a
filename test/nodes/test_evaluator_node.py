"""The evaluator on real middleware: figures of known errors, topics, JSON."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, Header
from std_srvs.srv import Trigger

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.messages import set_stamp, set_tilt
from twbr_estimation.nodes.evaluator_node import FIGURES, EvaluatorNode

TOPICS = ("imu/data", "tilt/compare", "reference/joint_states", "other/imu")
PERIOD = 2_000_000
START = 5_000_000_000


class Source:
    """Publishes a moving reference and estimates with known errors."""

    def __init__(self, graph: Any) -> None:
        create = graph.probe.create_publisher
        self._graph = graph
        self._reference = create(JointState, "reference/joint_states", 1000)
        self._compare = create(JointState, "tilt/compare", 1000)
        self._imu = {name: create(Imu, name, 1000) for name in ("imu/data", "other/imu")}

    def joints(self, publisher: Any, stamp: int, **positions: float) -> None:
        message = JointState(name=list(positions), position=list(positions.values()))
        set_stamp(message, stamp)
        publisher.publish(message)

    def imu(self, topic: str, stamp: int, tilt: float) -> None:
        message = Imu()
        set_stamp(message, stamp)
        set_tilt(message.orientation, tilt)
        self._imu[topic].publish(message)

    def publish(self, index: int, error: float, start: int = START) -> None:
        """Publish one instant; the error [rad] is that of `imu/data`."""
        stamp = start + PERIOD * index
        tilt = 0.2 * math.sin(0.01 * index)
        self.joints(self._reference, stamp, tilt=tilt)
        self.joints(self._compare, stamp, exact=tilt, high=tilt + math.radians(1.0))
        self.imu("imu/data", stamp, tilt + error)
        self.imu("other/imu", stamp, tilt - 2.0 * error)
        self._graph.executor.spin_once(timeout_sec=0.0)


def evaluator(graph: Any, **parameters: Any) -> EvaluatorNode:
    lossless = graph.lossless(*TOPICS)
    return graph.add(EvaluatorNode(**graph.options(**lossless, **parameters)))


def received(node: EvaluatorNode) -> int:
    node.publish_figures()
    scores = node._live.scores(delays=False)
    return min((score.samples for score in scores.values()), default=0)


def test_known_errors_come_back_as_figures_topics_and_json(graph: Any, tmp_path: Path) -> None:
    target = tmp_path / "scores.json"
    node = evaluator(
        graph,
        estimators=["active=imu/data", "other=/other/imu"],
        json_file=str(target),
        source="test",
    )
    source = Source(graph)
    topics = [f"/evaluator_node/active/{figure}" for figure in FIGURES]
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
    source._imu["imu/data"].publish(empty)
    graph.spin_until(lambda: node._live.refused == {"active": 1})
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


@pytest.mark.parametrize("entry", ["imu/data", "a b=imu/data", "=imu/data", "name="])
def test_a_wrong_estimator_is_refused(graph: Any, entry: str) -> None:
    with pytest.raises(ConfigurationError, match="NAME=TOPIC"):
        EvaluatorNode(**graph.options(estimators=[entry]))


def test_settings_are_fixed_once_it_runs(graph: Any) -> None:
    node = evaluator(graph)
    assert not node.set_parameters([Parameter("skip", value=1.0)])[0].successful


@pytest.mark.usefixtures("domain")
def test_a_run_without_data_ends_cleanly_and_says_so(python: str) -> None:
    program = (
        "import os, signal, sys, threading\n"
        "from twbr_estimation.nodes.evaluator_node import main\n"
        "threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "sys.exit(main())"
    )
    result = subprocess.run([python, "-c", program], capture_output=True, text=True, timeout=30)
    assert result.returncode == 0, result.stderr
    assert "no estimate has been compared" in result.stdout + result.stderr
    assert "Traceback" not in result.stderr
