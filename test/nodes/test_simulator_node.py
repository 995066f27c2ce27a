"""The simulator on real middleware: in lockstep, in real time, and below the drivers."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import Trigger

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.diagnostics import Level
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.simulator_node import SimulatorNode, compose
from twbr_estimation.ros_messages import stamp_of
from twbr_estimation.simulation.worlds import PAPER_CALIBRATION
from twbr_estimation.streams.control.balance import Standing

CALIBRATION = {
    f"calibration__{name}": list(getattr(PAPER_CALIBRATION, name))
    for name in ("gyro_bias", "accel_bias", "accel_scale_x", "accel_scale_z")
}
TRIES = 10
LATE = 40_000_000
"""Age of an estimate [ns] that a robot in real time may not survive; the usual one is 15 ms."""
STOPPED = tuple(
    each.value for each in (Standing.TILT_LATE, Standing.TILT_STALE, Standing.WHEELS_LATE)
)
"""Why the controller cuts the motors where the computer stops in between."""
LOSSLESS = ("imu/data_raw", "imu/data_corrected", "imu/data", "joint_states", "motor/command")


def simulator_in(graph: Any, **parameters: Any) -> SimulatorNode:
    given = {"world": "ideal", "duration": 5.0, **graph.lossless(*LOSSLESS), **parameters}
    return graph.add(SimulatorNode(**graph.options(**given)))


def estimation_in(graph: Any, *, calibrated: bool = False, **parameters: Any) -> list[Any]:
    """Add correction, filter and controller."""
    shared = {**graph.lossless(*LOSSLESS), **parameters}
    errors = CALIBRATION if calibrated else {}
    return [
        graph.add(CorrectionNode(**graph.options(**shared, **errors))),
        graph.add(FilterNode(**graph.options(**shared, timeout=10.0))),
        graph.add(ControllerNode(**graph.options(**shared, clock_timeout=60.0))),
    ]


def trigger(graph: Any, name: str) -> str:
    answer = graph.call(Trigger, f"simulator_node/{name}", Trigger.Request())
    assert answer.success
    return str(answer.message)


def lockstep_run(graph: Any, seed: int) -> list[tuple[int, float, float]]:
    """Return stamps, estimates and true tilts of the real nodes, until the push is over."""
    try:
        node = simulator_in(graph, world="paper", seed=seed, lockstep=True, paused=True)
        estimation_in(graph, calibrated=True, use_sim_time=True)
        estimates = graph.collect(Imu, "imu/data", 5000)
        truth: list[float] = []
        publish = node._publish

        def noted(reading: Any) -> None:
            truth.append(reading.truth.tilt)
            publish(reading)

        node._publish = noted  # type: ignore[method-assign]
        graph.settle()
        node.simulator.push(node._disturbance.current)
        trigger(graph, "resume")
        graph.spin_until(lambda: len(truth) > 800, 60.0)
        trigger(graph, "pause")
        graph.spin_until(lambda: len(estimates) >= 790)
        assert node._silent == 0
        return [
            (stamp_of(message), message.orientation.y, tilt)
            for message, tilt in zip(estimates[:790], truth[:790], strict=True)
        ]
    finally:
        graph.close()


def test_two_runs_in_lockstep_give_the_same_tilt(
    open_graph: Callable[[], Any],
) -> None:
    first = lockstep_run(open_graph(), 501)
    assert first == lockstep_run(open_graph(), 501)
    assert first != lockstep_run(open_graph(), 502)
    tilts = [tilt for *_, tilt in first]
    assert max(map(abs, tilts)) < 0.5, "it fell"
    assert max(map(abs, tilts)) > 0.01, "nothing happened"


def test_each_step_waits_for_its_command(graph: Any) -> None:
    node = simulator_in(graph, lockstep=True, lockstep_timeout=1.5)
    command = graph.probe.create_publisher(Float64MultiArray, "motor/command", 10)
    readings = graph.collect(Imu, "imu/data_raw")
    graph.spin_until(lambda: len(readings) == 1)
    for steps in range(1, 5):
        command.publish(Float64MultiArray(data=[0.0, 0.0]))
        graph.spin_until(lambda wanted=1 + 2 * steps: len(readings) == wanted)
    assert [stamp_of(each) for each in readings][-1] - stamp_of(readings[0]) == 20_000_000
    graph.spin_until(lambda: node.report().level is Level.ERROR)
    assert "no motor/command for 1." in node.report().message
    assert "period 0.005 s" in node.report().message
    graph.spin_until(lambda: len(readings) == 11)
    assert node.report().values["lockstep_timeouts"] == 1


@pytest.mark.parametrize("bad", [[], [1.0, 2.0, 3.0], [math.nan, 0.0]])
def test_bad_commands_are_counted_and_diagnosed(graph: Any, bad: list[float]) -> None:
    node = simulator_in(graph)
    diagnostics = graph.collect(DiagnosticArray, "/diagnostics")
    command = graph.probe.create_publisher(Float64MultiArray, "motor/command", 10)
    graph.settle()
    command.publish(Float64MultiArray(data=bad))
    graph.spin_until(lambda: node.simulator.counts["rejected"] == 1)
    assert node.simulator.counts["commands"] == 0

    def warned() -> bool:
        statuses = [status for message in diagnostics for status in message.status]
        return any("motor command" in status.message for status in statuses)

    graph.spin_until(warned)
    [status] = [s for each in diagnostics for s in each.status if "motor command" in s.message]
    assert status.level == Level.WARN.value


def test_real_time_keeps_its_rate_and_its_messages_are_whole(graph: Any) -> None:
    node = simulator_in(graph, wheel_joints=["left", "right"], frame_id="chip", reference_joint="t")
    imu, joints = graph.collect(Imu, "imu/data_raw"), graph.collect(JointState, "joint_states")
    reference = graph.collect(JointState, "reference/joint_states")
    graph.spin_until(lambda: len(imu) >= 400 and len(joints) >= 400 and len(reference) >= 400)
    stamps = [stamp_of(each) for each in imu]
    now = node.get_clock().now().nanoseconds
    assert abs(now - stamps[-1]) < 10**9
    steps = [later - sooner for sooner, later in pairwise(stamps)]
    late = node.simulator.counts["late"]
    assert min(steps) > 0 and sum(step != 2_500_000 for step in steps) <= late
    assert imu[-1].header.frame_id == "chip" and imu[-1].orientation_covariance[0] == -1.0
    assert imu[-1].linear_acceleration.z == pytest.approx(9.80665, abs=0.1)
    assert list(joints[-1].name) == ["left", "right"] and list(reference[-1].name) == ["t"]
    assert len(joints[-1].position) == len(joints[-1].velocity) == len(joints[-1].effort) == 2


def test_services_disturb_and_a_fall_is_published(graph: Any) -> None:
    node = simulator_in(graph, held=False)
    fallen = graph.collect(Bool, "simulator_node/fallen")
    assert node.set_parameters([Parameter("push_force", value=9.0)])[0].successful
    assert not node.set_parameters([Parameter("push_force", value=1e9)])[0].successful
    assert "9 N" in trigger(graph, "push")
    graph.spin_until(lambda: any(each.data for each in fallen))
    assert node.report().message == "fallen; call ~/stand_up"
    assert "stood up" in trigger(graph, "stand_up")
    graph.spin_until(lambda: not fallen[-1].data)
    for name in ("slip", "obstacle", "pause", "resume", "reset"):
        assert trigger(graph, name)


def test_a_wrong_world_is_refused(graph: Any) -> None:
    with pytest.raises(ConfigurationError, match="mars"):
        SimulatorNode(**graph.options(world="mars"))


def test_the_drivers_read_the_simulated_chips_and_the_robot_stays_upright(graph: Any) -> None:
    given = {"world": "paper", "sensors": "registers", "duration": 5.0, "compiled": True}
    slow = {"imu_period": 0.005, "mpu6050__poll_rate": 100.0, "poll_rate": 100.0}
    nodes = [graph.add(node) for node in compose(**graph.options(**given, **slow))]
    assert [node.get_name() for node in nodes] == ["simulator_node", "mpu6050_node", "encoder_node"]
    controller = estimation_in(graph, calibrated=True)[2]
    raw, estimates = graph.collect(Imu, "imu/data_raw"), graph.collect(Imu, "imu/data")
    simulator = nodes[0].simulator
    for _ in range(TRIES):  # physics does not wait for a computer that stops in between
        graph.spin_until(lambda: not simulator.held, 60.0)
        begun, falls, ages = simulator.robot.time, simulator.robot.falls, [0]

        def over(begun: float = begun, ages: list[int] = ages) -> bool:
            ages.append(nodes[0].get_clock().now().nanoseconds - stamp_of(estimates[-1]))
            return simulator.robot.time > begun + 4.0

        simulator.push(nodes[0]._disturbance.current)
        graph.spin_until(over, 60.0)
        if upright := simulator.robot.falls == falls and abs(simulator.latest.truth.tilt) < 0.3:
            break
        said = controller.report().message
        assert max(ages) > LATE or said.endswith(STOPPED), f"all estimates came in time; {said}"
        simulator.stand_up()
    assert upright, f"the computer stopped in between, in each of {TRIES} tries"
    assert len(raw) > 350 and len(estimates) > 350
    graph.spin_until(lambda: nodes[0].report().level is Level.OK)


def test_a_dead_band_that_never_releases_the_hand_is_explained(graph: Any) -> None:
    node = simulator_in(graph, paused=True)
    for _ in range(400):
        node.simulator.command((0.0, 0.0))
    trigger(graph, "resume")
    assert node.report().level is Level.OK
    node.simulator.command((0.0, 0.0))
    assert node.report().level is Level.WARN and "dead band" in node.report().message
    node.simulator.stand_up()
    assert node.report().level is Level.OK
