"""The controller on real middleware, in lockstep with a simulated robot."""

from __future__ import annotations

import math
from typing import Any

import pytest
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Float64, Float64MultiArray
from std_srvs.srv import SetBool

from nodes.simulated import SimulatedTopics, upright
from twbr_estimation.controllers import base, listed_controllers
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.controller_parameters import prepare
from twbr_estimation.nodes.diagnostics import Level
from twbr_estimation.ros_messages import set_stamp
from twbr_estimation.simulation.simulated_robot import SimulatedRobot

INPUTS = ("imu/data", "joint_states", "cmd_vel", "tilt")
CUT = (0.0, 0.0)


def controller_in(graph: Any, **parameters: Any) -> ControllerNode:
    """Add the node; in lockstep, time is that of `/clock`."""
    patient = {"clock_timeout": 60.0, **graph.lossless(*INPUTS)}
    given = {"use_sim_time": True, **patient, **parameters}
    return graph.add(ControllerNode(**graph.options(**given)))


def robot_in(graph: Any, delay: float = 0.005, **options: Any) -> SimulatedTopics:
    """Add a robot whose motors follow `delay` [s] after the step, as computing takes time."""
    robot = SimulatedRobot("ideal", 5, 0.005, disturbed=False, stay_down=True, command_delay=delay)
    robot.place(0.02)  # at rest upright nothing would happen
    return SimulatedTopics(graph, robot, perfect=True, **options)


@pytest.fixture
def balanced(graph: Any) -> tuple[ControllerNode, SimulatedTopics]:
    """A robot that has been kept upright for a second."""
    node, robot = controller_in(graph), robot_in(graph)
    graph.settle()
    assert upright(robot.run(1.0))
    assert node.report().level is Level.OK
    return node, robot


def test_it_keeps_the_robot_upright_under_pushes(balanced: Any) -> None:
    node, robot = balanced
    robot.robot.push(4.0)
    assert upright(robot.run(3.0))
    assert abs(robot.robot.truth.tilt) < 0.05
    assert node.report().message == "balancing with pid"


def test_a_tilt_without_rate_and_stamp_will_do(graph: Any) -> None:
    controller_in(graph, input="tilt")
    robot = robot_in(graph)
    tilt = graph.probe.create_publisher(Float64, "tilt", 1000)
    publish = robot.publish

    def both(reading: Any) -> None:
        publish(reading)
        tilt.publish(Float64(data=reading.truth.tilt))

    robot.publish = both  # type: ignore[method-assign]
    graph.settle()
    robot.run(0.05, wait=False)  # the clock starts
    assert upright(robot.run(1.0))
    robot.robot.push(4.0)
    assert upright(robot.run(3.0))


def test_controllers_switch_while_it_balances(balanced: Any) -> None:
    node, robot = balanced
    for name in [*listed_controllers(), "pid", *listed_controllers()]:
        assert node.set_parameters([Parameter("controller", value=name)])[0].successful
        before = robot.commands[-1]
        robot.robot.push(2.0)
        assert upright(robot.run(0.5))
        assert abs(robot.commands[-100][0] - before[0]) < 1.0
    assert robot.robot.falls == 0


def test_a_half_bad_request_changes_nothing(balanced: Any) -> None:
    node, robot = balanced
    before = node.get_parameter("pid.tilt_gain").value
    for bad, said in (
        (Parameter("controller", value="unheard_of"), "unheard_of"),
        (Parameter("pid.tilt_derivative", value=-1.0), "tilt_derivative"),
        (Parameter("robot.wheel_radius", value=-1.0), "wheel_radius"),
        (Parameter("recovery_tilt", value=0.5), None),
        (Parameter("fall_tilt", value=0.09), "recovery_tilt"),
    ):
        good = Parameter("pid.tilt_gain", value=before + 1.0)
        result = node.set_parameters_atomically([good, bad])
        assert result.successful == (said is None), bad.name
        if said is not None:
            assert said in result.reason
            assert node.get_parameter("pid.tilt_gain").value == before
        else:
            node.set_parameters_atomically(
                [Parameter("pid.tilt_gain", value=before), Parameter("recovery_tilt", value=0.1)]
            )
    assert upright(robot.run(0.2))


def test_a_fall_cuts_the_motors_until_the_robot_is_stood_up(balanced: Any) -> None:
    node, robot = balanced
    robot.robot.push(60.0)
    robot.run(2.0)
    assert robot.robot.held and set(robot.commands[-100:]) == {CUT}
    assert node.report().message == "motors cut: fallen"
    robot.robot.place(0.02)
    robot.run(2.0)
    assert abs(robot.robot.truth.tilt) < 0.05 and robot.commands[-1] != CUT
    assert node.report().values["falls"] == 1


def test_enable_cuts_and_starts(graph: Any, balanced: Any) -> None:
    node, robot = balanced
    answer = graph.call(SetBool, "/controller_node/enable", SetBool.Request(data=False))
    assert answer.success and "cut" in answer.message
    robot.run(0.05)
    assert set(robot.commands[-5:]) == {CUT}
    assert node.report().message.startswith("motors cut: disabled")
    answer = graph.call(SetBool, "/controller_node/enable", SetBool.Request(data=True))
    assert answer.message == "enabled"
    assert upright(robot.run(1.0))
    assert node.report().level is Level.OK


def test_an_invalid_tilt_cuts(graph: Any, balanced: Any) -> None:
    node, robot = balanced
    valid = graph.probe.create_publisher(Bool, "tilt/valid", 10)
    graph.settle()

    def cut() -> bool:
        robot.run(0.005)
        return bool(robot.commands[-1] == CUT)

    valid.publish(Bool(data=False))
    graph.spin_until(cut)
    assert "not valid" in node.report().message
    valid.publish(Bool(data=True))
    robot.robot.push(1.0)
    graph.spin_until(lambda: not cut())
    assert upright(robot.run(1.0)) and robot.commands[-1] != CUT


def test_silence_cuts_by_itself(graph: Any) -> None:
    node, robot = controller_in(graph, use_sim_time=False), robot_in(graph)
    graph.settle()
    robot.run(0.3)
    robot.commands.clear()
    graph.spin_until(lambda: CUT in robot.commands)
    assert node.report().level is Level.ERROR
    assert node.report().message == "motors cut: tilt is late"


def test_a_clock_that_stands_still_is_no_silence(graph: Any) -> None:
    """In lockstep a simulator takes its time."""
    node, robot = controller_in(graph), robot_in(graph)
    graph.settle()
    robot.run(0.5)
    answered = iter(range(10))
    graph.spin_until(lambda: next(answered, None) is None)  # commands under way come in
    robot.commands.clear()
    rounds = iter(range(50))
    graph.spin_until(lambda: next(rounds, None) is None)  # a second of wall time
    assert robot.commands == []
    assert upright(robot.run(0.5)) and node.report().level is Level.OK


def test_nothing_but_numbers_is_published(graph: Any, balanced: Any) -> None:
    node, robot = balanced
    imu = graph.probe.create_publisher(Imu, "imu/data", 1000)
    cmd = graph.probe.create_publisher(TwistStamped, "cmd_vel", 1000)
    graph.settle()
    for value in (math.nan, math.inf, -math.inf):
        bad = Imu()
        set_stamp(bad, robot.robot.stamp + 1_000_000)
        bad.orientation.y, bad.orientation.w = value, 1.0
        bad.angular_velocity.y = value
        imu.publish(bad)
        twist = TwistStamped()
        twist.twist.linear.x = twist.twist.angular.z = value
        cmd.publish(twist)
    graph.spin_until(lambda: node.report().values.get("tilt_not_finite") == 3)
    assert upright(robot.run(1.0))
    assert all(math.isfinite(sum(each)) for each in robot.commands)


@pytest.mark.parametrize("stamped", [True, False])
def test_velocity_commands(graph: Any, stamped: bool) -> None:
    node, robot = controller_in(graph, use_stamped_vel=stamped), robot_in(graph)
    kind = TwistStamped if stamped else Twist
    cmd = graph.probe.create_publisher(kind, "cmd_vel", 1000)
    graph.settle()
    robot.run(0.5)
    for _ in range(30):
        message = kind()
        (message.twist if stamped else message).linear.x = 0.2
        cmd.publish(message)
        assert upright(robot.run(0.1))
    assert robot.robot.truth.velocity == pytest.approx(0.2, abs=0.05)
    assert upright(robot.run(4.0))
    assert abs(robot.robot.truth.velocity) < 0.05
    assert node.report().level is Level.OK


def test_two_wheels_turn(graph: Any) -> None:
    controller_in(
        graph,
        robot__track_width=0.2,
        left_wheel_joint="port",
        right_wheel_joint="starboard",
    )
    robot = robot_in(graph, joints=("port", "starboard"))
    cmd = graph.probe.create_publisher(TwistStamped, "cmd_vel", 1000)
    graph.settle()
    robot.run(0.5)
    message = TwistStamped()
    message.twist.angular.z = 1.0
    cmd.publish(message)
    robot.run(0.2)
    left, right = robot.commands[-1]
    assert right > left + 0.1  # to the left


def test_torques_balance_as_well(graph: Any) -> None:
    controller_in(graph, publish_torque=True)
    plant = SimulatedRobot("ideal", 5, 0.005).plant
    gain = plant.gear_ratio * plant.torque_constant / plant.winding_resistance

    def voltages(torques: tuple[float, ...], reading: Any) -> tuple[float, ...]:
        wheel = reading.truth.velocity / plant.wheel_radius - reading.truth.rate
        emf = plant.back_emf_constant * plant.gear_ratio * wheel
        return tuple(each / gain + emf for each in torques)

    robot = robot_in(graph, 0.0, command="motor/torque", voltages=voltages)
    graph.settle()
    robot.run(0.5)
    robot.robot.push(4.0)
    assert upright(robot.run(3.0))


def test_deactivation_cuts_and_a_new_activation_begins_afresh(balanced: Any) -> None:
    node, robot = balanced
    robot.commands.clear()
    node.trigger_deactivate()
    robot.graph.spin_until(lambda: bool(robot.commands))
    robot.run(0.1, wait=False)
    assert set(robot.commands) == {CUT} and len(robot.commands) == 1
    assert node.report().level is Level.STALE
    node.trigger_activate()
    robot.robot.place(0.02)
    robot.run(1.0)
    assert robot.commands[5] == CUT and robot.commands[-1] != CUT


def test_its_end_cuts(graph: Any) -> None:
    received: list[Any] = graph.collect(Float64MultiArray, "motor/command")
    node, robot = controller_in(graph), robot_in(graph)
    graph.settle()
    robot.run(0.5)
    graph.spin_until(lambda: len(received) == 100)
    graph.executor.remove_node(node)
    graph.nodes.remove(node)
    node.destroy_node()
    graph.spin_until(lambda: len(received) == 101)
    assert tuple(received[-1].data) == CUT and tuple(received[-2].data) != CUT


def test_what_cannot_be_used_is_reported(graph: Any) -> None:
    node = controller_in(graph)
    imu = graph.probe.create_publisher(Imu, "imu/data", 10)
    graph.settle()
    raw = Imu()
    raw.orientation_covariance[0] = -1.0
    set_stamp(raw, 10**9)
    imu.publish(raw)
    graph.spin_until(lambda: "reports no orientation" in node.report().message)


@pytest.mark.parametrize(
    ("parameter", "value"), [("controller", "unheard_of"), ("period", 1.0), ("input", "sonar")]
)
def test_a_start_with_a_wrong_parameter_is_refused(graph: Any, parameter: str, value: Any) -> None:
    with pytest.raises(ConfigurationError, match=parameter):
        ControllerNode(**graph.options(**{parameter: value}))


def test_a_prepared_controller_is_switched_to_at_once(graph: Any) -> None:
    """Deriving one may take seconds, in which the robot would fall."""
    node = controller_in(graph, prepare_all=False)
    prepare(node._chosen.current)
    derived = base._coefficients.cache_info().misses
    for name in listed_controllers():
        assert node.set_parameters([Parameter("controller", value=name)])[0].successful
    assert base._coefficients.cache_info().misses == derived


def test_the_controllers_to_choose_from_are_described(graph: Any) -> None:
    """`ros2 param describe /controller_node controller` names them."""
    descriptor = controller_in(graph, prepare_all=False).describe_parameter("controller")
    assert descriptor.additional_constraints == f"one of: {', '.join(listed_controllers())}"
