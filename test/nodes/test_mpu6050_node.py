"""The IMU's node on real middleware, with the simulated chip behind the bus' interface."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, Temperature

from twbr_estimation.nodes import lifecycle
from twbr_estimation.nodes.diagnostics import Level
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node
from twbr_estimation.sensors import mpu6050_reader
from twbr_estimation.sensors.motion import swing
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050

TRANSITIONS = {
    "configure": Transition.TRANSITION_CONFIGURE,
    "activate": Transition.TRANSITION_ACTIVATE,
    "deactivate": Transition.TRANSITION_DEACTIVATE,
    "cleanup": Transition.TRANSITION_CLEANUP,
}


def _start(graph: Any, chip: SimulatedMpu6050 | None = None, **parameters: Any) -> Mpu6050Node:
    node: Mpu6050Node = graph.add(Mpu6050Node(chip, **graph.options(**parameters)))
    return node


def _stamps(messages: list[Imu]) -> list[int]:
    return [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in messages]


def _state(graph: Any) -> int:
    response = graph.call(GetState, "/mpu6050_node/get_state", GetState.Request())
    return int(response.current_state.id)


def _change(graph: Any, transition: str) -> bool:
    request = ChangeState.Request()
    request.transition.id = TRANSITIONS[transition]
    return bool(graph.call(ChangeState, "/mpu6050_node/change_state", request).success)


@pytest.mark.parametrize("reading", ["burst", "fifo"])
def test_it_publishes_what_the_chip_measures_without_being_asked(graph: Any, reading: str) -> None:
    received = graph.collect(Imu, "imu/data_raw")
    _start(graph, simulated=True, mpu6050__reading=reading, mpu6050__poll_rate=100.0)
    graph.spin_until(lambda: len(received) >= 100)
    stamps = _stamps(received)
    assert all(later > earlier for earlier, later in pairwise(stamps))
    errors = [
        message.angular_velocity.y - swing(stamp * 1e-9).gyro_y
        for message, stamp in zip(received, stamps, strict=True)
    ]
    assert np.sqrt(np.mean(np.square(errors))) < np.radians(0.15)
    assert np.mean([each.linear_acceleration.z for each in received]) == pytest.approx(9.8, abs=0.1)


def test_messages_follow_rep_145(graph: Any) -> None:
    received = graph.collect(Imu, "imu/data_raw")
    temperatures = graph.collect(Temperature, "imu/temperature")
    _start(
        graph,
        simulated=True,
        frame_id="chip",
        mpu6050__gyro_stddev=0.02,
        mpu6050__accel_stddev=0.5,
    )
    graph.spin_until(lambda: received and temperatures)
    message = received[0]
    assert message.header.frame_id == temperatures[0].header.frame_id == "chip"
    assert message.orientation_covariance[0] == -1.0
    assert list(message.angular_velocity_covariance) == pytest.approx(
        [4e-4, 0, 0, 0, 4e-4, 0, 0, 0, 4e-4]
    )
    assert message.linear_acceleration_covariance[8] == 0.25
    assert temperatures[0].temperature == pytest.approx(25.0, abs=0.1)


def test_a_lifecycle_manager_is_in_charge_without_autostart(graph: Any) -> None:
    received = graph.collect(Imu, "imu/data_raw")
    node = _start(graph, simulated=True, autostart=False)
    assert _state(graph) == State.PRIMARY_STATE_UNCONFIGURED
    assert _change(graph, "configure")
    assert _state(graph) == State.PRIMARY_STATE_INACTIVE
    assert node.reader is not None
    graph.spin_until(lambda: node.reader.counters.samples >= 5)
    assert received == []
    assert _change(graph, "activate")
    graph.spin_until(lambda: len(received) >= 5)
    assert _change(graph, "deactivate")
    assert _change(graph, "cleanup")
    assert _state(graph) == State.PRIMARY_STATE_UNCONFIGURED
    assert _change(graph, "configure"), "it can be configured again"
    assert _change(graph, "activate")
    before = len(received)
    graph.spin_until(lambda: len(received) >= before + 5)


def test_a_missing_chip_leaves_it_unconfigured_until_it_answers(
    graph: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lifecycle, "RETRY_PERIOD", 0.05)
    chip = SimulatedMpu6050(time.time_ns)
    chip.nack(1)
    received = graph.collect(Imu, "imu/data_raw")
    node = _start(graph, chip)
    assert not node.is_open
    assert "nothing answers at 0x68" in node.failure
    graph.spin_until(lambda: len(received) >= 5)
    assert node.failure == ""


def test_a_missing_bus_fails_the_transition_not_the_process(graph: Any) -> None:
    pytest.importorskip("smbus2")
    node = _start(graph, autostart=False, mpu6050__bus=250)
    assert not _change(graph, "configure")
    assert _state(graph) == State.PRIMARY_STATE_UNCONFIGURED
    assert "/dev/i2c-250" in node.failure
    node.set_parameters([Parameter("simulated", value=True)])
    assert _change(graph, "configure")


@pytest.mark.parametrize(
    ("fault", "counter"), [("nack", "bus_errors"), ("brown_out", "lost_settings")]
)
def test_it_outlives_faults_and_reports_them(graph: Any, fault: str, counter: str) -> None:
    chip = SimulatedMpu6050(time.time_ns)
    received = graph.collect(Imu, "imu/data_raw")
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    node = _start(graph, chip)
    graph.spin_until(lambda: len(received) >= 5)
    chip.nack(17) if fault == "nack" else chip.brown_out()
    graph.spin_until(lambda: node.reader.counters.reinitialisations == 1 and node.reader.running)
    before = len(received)
    graph.spin_until(lambda: len(received) >= before + 5)

    def reported() -> bool:
        latest = {each.key: each.value for each in diagnostics[-1].status[0].values}
        return int(latest.get(counter, "0")) > 0 and latest["reinitialisations"] == "1"

    graph.spin_until(lambda: bool(diagnostics) and reported())


def test_a_simulated_chip_lives_in_the_time_of_the_simulation(graph: Any) -> None:
    received = graph.collect(Imu, "imu/data_raw")
    clock = graph.probe.create_publisher(Clock, "/clock", 10)
    node = _start(graph, simulated=True, use_sim_time=True, mpu6050__poll_rate=100.0)
    assert node.is_active
    graph.spin_until(lambda: clock.get_subscription_count() > 0)
    message = Clock()
    for tick in range(1, 51):
        seen = len(received)
        message.clock.nanosec = tick * 10_000_000
        clock.publish(message)
        graph.spin_until(lambda seen=seen: len(received) > seen)
    assert _stamps(received)[-40:] == [tick * 10_000_000 for tick in range(11, 51)]
    errors = [
        message.angular_velocity.y - swing(stamp * 1e-9).gyro_y
        for message, stamp in zip(received, _stamps(received), strict=True)
    ]
    assert np.sqrt(np.mean(np.square(errors[10:]))) < np.radians(0.15)


@pytest.mark.parametrize("simulated", [False, True])
def test_it_polls_by_a_clock_that_cannot_be_set(graph: Any, simulated: bool) -> None:
    chip = None if simulated else SimulatedMpu6050(time.monotonic_ns)
    node = _start(graph, chip, simulated=simulated)
    assert node.is_active
    kinds = {timer.clock.clock_type for timer in node.timers}
    assert kinds == {ClockType.STEADY_TIME}


def test_a_dead_gyro_is_an_error_in_words(graph: Any) -> None:
    class GyroDead(SimulatedMpu6050):
        def _packet(self, seconds: float) -> bytes:
            return super()._packet(seconds)[:8] + bytes(6)

    node = _start(graph, GyroDead(time.monotonic_ns))
    graph.spin_until(lambda: bool(node.reader.defect))
    graph.spin_until(lambda: node.reader.running and node.reader.counters.samples > 500)
    report = node.report()
    assert report.level is Level.ERROR
    assert report.message.startswith("gyro x, y, z stuck at 0")
    assert report.values["stuck_words"] == 3


def test_full_scales_that_differ_from_the_robot_s_are_said(graph: Any) -> None:
    given = {"robot__gyro_range": 4.363323129985824, "robot__accel_range": 78.4532}
    node = _start(graph, simulated=True, **given)
    graph.spin_until(lambda: node.reader.counters.samples > 10)
    report = node.report()
    assert report.level is Level.WARN
    assert report.message == "robot.gyro_range is 4.36332, the chip is set to 17.4533"


def test_counters_outlive_the_bus(graph: Any) -> None:
    chip = SimulatedMpu6050(time.monotonic_ns)
    node = _start(graph, chip)
    graph.spin_until(lambda: node.reader.counters.samples > 10)
    chip.nack(1)
    graph.spin_until(lambda: node.reader.counters.bus_errors == 1)
    node.lose_device("unplugged")
    node.begin()
    graph.spin_until(lambda: node.reader.counters.samples > 20)
    assert node.report().values["bus_errors"] == 1


def test_it_is_no_fault_to_have_no_sample_yet(graph: Any) -> None:
    node = _start(graph, SimulatedMpu6050(time.monotonic_ns))
    assert node.is_active
    assert node.report().level is Level.OK


def test_the_chip_cannot_be_changed_while_it_is_read(graph: Any) -> None:
    received = graph.collect(Imu, "imu/data_raw")
    node = _start(graph, simulated=True)
    (refused,) = node.set_parameters([Parameter("mpu6050.accel_range_g", value=4)])
    assert not refused.successful
    assert "unconfigured" in refused.reason
    (accepted,) = node.set_parameters([Parameter("mpu6050.accel_stddev", value=0.3)])
    assert accepted.successful
    graph.spin_until(
        lambda: bool(received) and received[-1].linear_acceleration_covariance[0] == 0.09
    )


def test_a_dead_bus_is_opened_again(graph: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lifecycle, "RETRY_PERIOD", 0.05)
    monkeypatch.setattr(mpu6050_reader, "FIRST_WAIT", 0.001)
    chip = SimulatedMpu6050(time.time_ns)
    received = graph.collect(Imu, "imu/data_raw")
    node = _start(graph, chip)
    graph.spin_until(lambda: len(received) >= 5)
    chip.nack(10**6)
    graph.spin_until(lambda: not node.is_open)
    assert _state(graph) == State.PRIMARY_STATE_UNCONFIGURED
    assert "Remote I/O error" in node.failure
    chip.nack(0)
    before = len(received)
    graph.spin_until(lambda: len(received) >= before + 5)
    assert node.is_active


def test_a_defect_while_opening_ends_unconfigured(
    graph: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = _start(graph, simulated=True, autostart=False)
    with monkeypatch.context() as patch:
        patch.setattr(node, "open_device", lambda: 1 / 0)
        assert not _change(graph, "configure")
    assert _state(graph) == State.PRIMARY_STATE_UNCONFIGURED
    assert _change(graph, "configure")
