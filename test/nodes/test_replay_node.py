"""Replaying recordings on real middleware, with counted messages."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger

from twbr_estimation.bags import write_recording
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.nodes.replay_node import ReplayNode
from twbr_estimation.recording import ImuTrack, Recording, TiltTrack, WheelTrack
from twbr_estimation.ros_messages import stamp_of

START = 1_700_000_000_000_000_000


def make_bag(folder: Path, samples: int, period: int = 2_000_000) -> Path:
    """Write a recording of noise with wheels and reference."""
    random = np.random.default_rng(2)
    stamps = START + period * np.arange(samples)
    recording = Recording(
        "noise",
        ImuTrack(stamps, random.normal(size=(samples, 3)), random.normal(size=(samples, 3))),
        WheelTrack(stamps, random.normal(size=(samples, 2))),
        TiltTrack(stamps, random.normal(size=samples)),
    )
    write_recording(folder / "bag", recording)
    return folder / "bag"


def stamps_of(messages: list[Any]) -> list[int]:
    return [stamp_of(message) for message in messages]


def replay(graph: Any, bag: Path, **parameters: Any) -> ReplayNode:
    """Add a replay node that waits for the probe's subscription to the IMU."""
    parameters = {"wait_for": ["imu/data_raw"], "delay": 0.2, **parameters}
    return graph.add(ReplayNode(**graph.options(bag=str(bag), **parameters)))


def test_every_message_arrives_in_order_and_unchanged(graph: Any, tmp_path: Path) -> None:
    bag = make_bag(tmp_path, 500)
    imu = graph.collect(Imu, "imu/data_raw")
    wheels = graph.collect(JointState, "joint_states")
    reference = graph.collect(JointState, "reference/joint_states")
    clock = graph.collect(Clock, "/clock")
    replay(graph, bag, wait_for=["imu/data_raw", "joint_states", "reference/joint_states"])
    graph.spin_until(lambda: min(len(imu), len(wheels), len(reference)) == 500)
    expected = [START + 2_000_000 * k for k in range(500)]
    assert stamps_of(imu) == stamps_of(wheels) == stamps_of(reference) == expected
    assert wheels[0].name == ["left_wheel_joint", "right_wheel_joint"]
    assert len(clock) == 100  # 1 s in steps of 10 ms


def test_as_fast_as_a_slow_consumer_can_take_it_with_nothing_lost(
    graph: Any, tmp_path: Path
) -> None:
    bag = make_bag(tmp_path, 3000)
    echo = graph.probe.create_publisher(Imu, "imu/data", 10)
    received: list[int] = []

    def consume(message: Imu) -> None:
        received.append(stamp_of(message))
        echo.publish(message)

    graph.probe.create_subscription(Imu, "imu/data_raw", consume, 20)
    node = replay(graph, bag, rate=0.0, follow=["imu/data"], window=15)
    graph.spin_until(lambda: len(received) == 3000)
    graph.spin_until(lambda: node.player.passes == 1)
    assert received == [START + 2_000_000 * k for k in range(3000)]
    assert node.player.stalls == 0


def test_a_stretch_is_played_in_a_loop_until_it_is_switched_off(graph: Any, tmp_path: Path) -> None:
    bag = make_bag(tmp_path, 500)
    imu = graph.collect(Imu, "imu/data_raw")
    node = replay(graph, bag, rate=2.0, loop=True, start=0.2, duration=0.1)
    graph.spin_until(lambda: len(imu) >= 150)
    assert node.set_parameters([Parameter("loop", value=False)])[0].successful
    graph.spin_until(lambda: node.report().message == "finished")
    once = [START + 200_000_000 + 2_000_000 * k for k in range(50)]
    graph.spin_until(lambda: len(imu) == 50 * node.player.passes)
    assert stamps_of(imu) == once * node.player.passes


def test_pause_and_resume(graph: Any, tmp_path: Path) -> None:
    bag = make_bag(tmp_path, 500)
    imu = graph.collect(Imu, "imu/data_raw")
    node = replay(graph, bag, paused=True)
    graph.spin_until(lambda: node.report().message == "paused")
    resumed = graph.call(Trigger, "/replay_node/resume", Trigger.Request())
    assert resumed.success and resumed.message.startswith("playing")
    graph.spin_until(lambda: len(imu) > 50)
    assert graph.call(Trigger, "/replay_node/pause", Trigger.Request()).success
    played = node.player.played
    for _ in range(5):
        graph.executor.spin_once(timeout_sec=0.02)
    assert node.player.played == played < 1500
    graph.call(Trigger, "/replay_node/resume", Trigger.Request())
    graph.spin_until(lambda: len(imu) == 500)


def test_pause_is_reported_at_once_and_an_end_as_an_end(graph: Any, tmp_path: Path) -> None:
    imu = graph.collect(Imu, "imu/data_raw")
    reports = graph.collect(DiagnosticArray, "/diagnostics")
    node = replay(graph, make_bag(tmp_path, 4000), paused=True)
    graph.spin_until(lambda: node._state == "playing")
    node._diagnostics._timer.cancel()  # what comes now comes of the services
    graph.call(Trigger, "/replay_node/resume", Trigger.Request())
    graph.spin_until(lambda: reports and reports[-1].status[0].message == "playing")
    graph.spin_until(lambda: len(imu) > 20)
    graph.call(Trigger, "/replay_node/pause", Trigger.Request())
    graph.spin_until(lambda: reports[-1].status[0].message == "paused")
    assert node.set_parameters([Parameter("rate", value=50.0)])[0].successful
    graph.call(Trigger, "/replay_node/resume", Trigger.Request())
    graph.spin_until(lambda: node.report().message == "finished")
    answer = graph.call(Trigger, "/replay_node/pause", Trigger.Request())
    assert answer.message.startswith("finished at")


def test_restamped_messages_begin_now(graph: Any, tmp_path: Path) -> None:
    bag = make_bag(tmp_path, 100)
    imu = graph.collect(Imu, "imu/data_raw")
    before = graph.probe.get_clock().now().nanoseconds
    replay(graph, bag, restamp=True, rate=10.0)
    graph.spin_until(lambda: len(imu) == 100)
    stamps = stamps_of(imu)
    assert before < stamps[0] < graph.probe.get_clock().now().nanoseconds
    assert set(np.diff(stamps).tolist()) == {2_000_000}


def test_recorded_bytes_are_those_of_the_middleware(graph: Any, tmp_path: Path) -> None:
    bag = make_bag(tmp_path, 1)
    imu = graph.collect(Imu, "imu/data_raw")
    node = replay(graph, bag)
    graph.spin_until(lambda: len(imu) == 1)
    topic, content = node.player._source.message(0)
    assert topic == "/imu/data_raw"
    given = bytearray(serialize_message(imu[0])[: len(content)])
    text_end = 4 + 12 + len(imu[0].header.frame_id) + 1
    padding = slice(text_end, text_end + (4 - text_end) % 8)
    given[padding] = content[padding]  # where the middleware leaves what its buffer held
    assert bytes(given) == content and padding.stop < len(content)


def test_only_speed_and_loop_can_change(graph: Any, tmp_path: Path) -> None:
    node = replay(graph, make_bag(tmp_path, 2))
    for name, value, accepted in (
        ("rate", 2.0, True),
        ("rate", -1.0, False),
        ("start", 1.0, False),
    ):
        assert node.set_parameters([Parameter(name, value=value)])[0].successful is accepted


def test_what_cannot_be_played_is_an_error(graph: Any, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="bag"):
        ReplayNode(**graph.options())
    with pytest.raises(RecordingError, match="nothing_here"):
        ReplayNode(**graph.options(bag=str(tmp_path / "nothing_here")))


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize(
    ("settings", "status", "said"),
    [
        (["-p", "exit_at_end:=true", "-p", "rate:=0.0"], 0, "played 30 messages"),
        (["-p", "wait_for:=['/nobody']", "-p", "wait_limit:=0.2"], 1, "no publisher of /nobody"),
    ],
)
def test_the_process_ends_at_the_end_or_without_a_graph(
    python: str, tmp_path: Path, settings: list[str], status: int, said: str
) -> None:
    bag = make_bag(tmp_path, 10)
    program = "import sys; from twbr_estimation.nodes.replay_node import main; sys.exit(main())"
    command = [python, "-c", program, "--ros-args", "-p", f"bag:={bag}", *settings]
    result = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert result.returncode == status, result.stderr
    assert said in result.stdout + result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("topic", "kind", "why"),
    [
        ("/option/Auto Exposure/value", "std_msgs/msg/Float64", "topic name"),
        ("/x", "", "not of the form"),
        ("/x", "unknown type", "not of the form"),
        ("/x", "no_such_package/msg/Thing", "not installed"),
        ("/x//y", "std_msgs/msg/Float64", "opic name"),
        ("/1/y", "std_msgs/msg/Float64", "opic name"),
        ("", "std_msgs/msg/Float64", "opic name"),
    ],
)
def test_what_ros_has_no_name_for_is_left_out_and_named(
    graph: Any, tmp_path: Path, topic: str, kind: str, why: str
) -> None:
    node = replay(graph, make_bag(tmp_path, 3), paused=True)
    said: list[str] = []
    node.get_logger().warning = said.append
    node._announce(topic, kind)
    assert topic not in node._publishers_by_topic
    assert len(said) == 1 and why in said[0] and repr(topic) in said[0]


def test_messages_of_topics_that_are_not_played_do_not_count(graph: Any, tmp_path: Path) -> None:
    node = replay(graph, make_bag(tmp_path, 3), paused=True)
    (topic, *_) = node._publishers_by_topic
    node.publish("/not/played", b"")
    node.publish(topic, bytes(100))
    values = node.report().values
    assert (values["messages"], values["messages_of_topics_left_out"]) == (1, 1)
    assert node._summary().endswith("; 1 of topics that are not played")
    node.player.stalls = 2
    assert "2 times a followed topic stopped reporting" in node._summary()
