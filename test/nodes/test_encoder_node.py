"""The encoders' node on real middleware, with simulated counters."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import pytest
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from twbr_estimation.nodes import encoder_node, lifecycle
from twbr_estimation.nodes.diagnostics import Level
from twbr_estimation.nodes.encoder_node import EncoderNode
from twbr_estimation.sensors.encoder import EncoderSettings
from twbr_estimation.sensors.motion import swing_tilt
from twbr_estimation.sensors.simulated_counter import SimulatedCounter

ENCODER = EncoderSettings()


def _start(graph: Any, given: tuple[SimulatedCounter, ...] = (), **parameters: Any) -> Any:
    return graph.add(EncoderNode(given, **graph.options(**parameters)))


def _rolling(speed: float) -> SimulatedCounter:
    start = time.time()
    return SimulatedCounter(time.time_ns, lambda t: speed * (t - start), ENCODER)


def _stamp(message: JointState) -> int:
    return int(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


def test_two_wheels_with_their_signs(graph: Any) -> None:
    received = graph.collect(JointState, "joint_states")
    _start(graph, (_rolling(3.0), _rolling(-2.0)), signs=[1, -1])
    graph.spin_until(lambda: len(received) >= 100)
    assert all(_stamp(later) > _stamp(earlier) for earlier, later in pairwise(received))
    first, last = received[20], received[-1]
    assert last.name == ["left_wheel_joint", "right_wheel_joint"]
    seconds = (_stamp(last) - _stamp(first)) * 1e-9
    # Two counts, and 2 ms between a stamp and its read on a busy machine.
    limit = 2 * ENCODER.angle_per_count + 3.0 * 0.002
    assert last.position[0] - first.position[0] == pytest.approx(3.0 * seconds, abs=limit)
    assert last.position[1] - first.position[1] == pytest.approx(2.0 * seconds, abs=limit)
    velocities = [message.velocity[0] for message in received[20:]]
    assert sum(velocities) / len(velocities) == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize(
    ("use_sim_time", "kind"), [(False, ClockType.STEADY_TIME), (True, ClockType.ROS_TIME)]
)
def test_it_polls_by_a_clock_that_cannot_be_set(
    graph: Any, use_sim_time: bool, kind: ClockType
) -> None:
    node = _start(graph, simulated=True, use_sim_time=use_sim_time)
    kinds = [timer.clock.clock_type for timer in node.timers]
    steady = 2 if kind is ClockType.ROS_TIME else 3  # the starter and the report, not the poll
    assert (len(kinds), kinds.count(ClockType.STEADY_TIME)) == (3, steady)


def test_one_wheel(graph: Any) -> None:
    received = graph.collect(JointState, "joint_states")
    _start(graph, simulated=True, joint_names=["wheel"])
    graph.spin_until(lambda: bool(received))
    assert received[0].name == ["wheel"]
    assert len(received[0].position) == len(received[0].velocity) == 1


def test_the_reference_follows_the_tilt_and_can_be_zeroed(graph: Any) -> None:
    received = graph.collect(JointState, "reference/joint_states")
    _start(graph, simulated=True, role="reference", start_angle=0.5)
    graph.spin_until(lambda: len(received) >= 50)
    assert received[0].name == ["tilt"]
    turned = received[-1].position[0] - received[0].position[0]
    true = swing_tilt(_stamp(received[-1]) * 1e-9) - swing_tilt(_stamp(received[0]) * 1e-9)
    assert turned == pytest.approx(true, abs=2 * ENCODER.angle_per_count)
    response = graph.call(Trigger, "/encoder_node/set_zero", Trigger.Request())
    assert response.success, response.message
    before = len(received)
    graph.spin_until(lambda: len(received) > before + 1)
    now, then = received[-1], _stamp(received[before])
    true = swing_tilt(_stamp(now) * 1e-9) - swing_tilt(then * 1e-9)
    assert now.position[0] == pytest.approx(0.5 + true, abs=0.02)


def test_set_zero_says_when_nothing_is_open(graph: Any) -> None:
    _start(graph, autostart=False)
    response = graph.call(Trigger, "/encoder_node/set_zero", Trigger.Request())
    assert not response.success


def test_a_missing_counter_leaves_it_unconfigured_with_the_reason(graph: Any) -> None:
    node = _start(graph, counters=["/nowhere/count0", "/nowhere/count1"])
    assert not node.is_open
    assert "/nowhere/count0" in node.failure


def test_it_outlives_failing_reads(graph: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lifecycle, "RETRY_PERIOD", 0.05)
    counter = _rolling(1.0)
    received = graph.collect(JointState, "joint_states")
    node = _start(graph, (counter,), joint_names=["wheel"])
    graph.spin_until(lambda: len(received) >= 5)
    node._diagnostics._timer.cancel()  # no report between the failures and ours
    counter.fail(3)  # three polls are skipped
    graph.spin_until(lambda: node.errors == 3)
    assert node.is_active
    assert node.report()[:2] == (Level.WARN, "3 reads failed")
    assert node.report().level is Level.OK, "a report holds what is new"
    counter.fail(8)  # opened again
    graph.spin_until(lambda: not node.is_open)
    before = len(received)
    graph.spin_until(lambda: len(received) >= before + 5)
    assert node.is_active
    assert node.failure == ""


def test_silence_is_an_error(graph: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    received = graph.collect(JointState, "joint_states")
    node = _start(graph, (_rolling(1.0),), joint_names=["wheel"])
    graph.spin_until(lambda: len(received) >= 5)
    assert node.report().level is Level.OK
    for timer in node.timers:
        timer.cancel()
    later = time.monotonic() + 12.0
    monkeypatch.setattr(encoder_node.time, "monotonic", lambda: later)
    report = node.report()
    assert report.level is Level.ERROR
    assert report.message.startswith("no joint states for 12")


def test_a_silence_from_the_start_counts_from_the_activation(
    graph: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without /clock nothing is ever published; the time since the boot is no silence."""
    node = _start(graph, simulated=True, use_sim_time=True)
    later = encoder_node.time.monotonic() + 12.0
    monkeypatch.setattr(encoder_node.time, "monotonic", lambda: later)
    message = node.report().message
    assert "no joint states" in message and float(message.split()[-2]) < 60.0


def test_counters_outlive_the_device(graph: Any) -> None:
    counter = _rolling(1.0)
    node = _start(graph, (counter,), joint_names=["wheel"])
    counter.errors, counter.ambiguous = 7, 2
    node.lose_device("unplugged")
    assert node.report().values["wheel.missed_edges"] == 7
    counter.errors, counter.ambiguous = 3, 0
    node.begin()
    values = node.report().values
    assert values["wheel.missed_edges"] == 10
    assert values["wheel.ambiguous_edges"] == 2


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("joint_names", ["a", "b", "c"], "1 or 2"),
        ("signs", [1, 0], "not all 1 or -1"),
        ("signs", [1], "2 needed"),
        ("encoder.counts_per_turn", 2000, "unconfigured"),
    ],
)
def test_parameters_are_refused_with_the_reason(
    graph: Any, name: str, value: object, reason: str
) -> None:
    node = _start(graph, simulated=True)
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert reason in result.reason
