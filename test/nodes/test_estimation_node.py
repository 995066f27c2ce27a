"""All nodes in one process: the same numbers, without the hops between them."""

from __future__ import annotations

from typing import Any

import numpy as np
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Float64

from nodes.simulated import SimulatedTopics, upright
from twbr_estimation.batch import correct, run_filter
from twbr_estimation.configuration.filter_settings import DEFAULT_FILTER
from twbr_estimation.filters.base import filter_named
from twbr_estimation.nodes.estimation_node import compose
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.robot import Robot, Setup
from twbr_estimation.ros_messages import stamp_of
from twbr_estimation.simulation.simulated_robot import SimulatedRobot


def test_composed_equals_offline(graph: Any, sensors: Any) -> None:
    lossless = graph.lossless(
        "imu/data_raw", "joint_states", published=("tilt", "imu/data_corrected")
    )
    for node in compose(**graph.options(drivers=False, **lossless)):
        graph.add(node)
    tilts = graph.collect(Float64, "tilt")
    corrected = graph.collect(Imu, "imu/data_corrected")
    graph.settle()
    drive = sensors.drive(200)
    sensors.play(drive)
    graph.spin_until(lambda: len(tilts) == len(corrected) == 200)
    entry = filter_named(DEFAULT_FILTER)
    track = correct(pair(drive.imu, drive.wheels), Setup())
    expected = run_filter(entry, entry.configure(), track, Robot()).tilt
    np.testing.assert_allclose([each.data for each in tilts], expected, atol=1e-12)
    assert [stamp_of(each) for each in corrected] == drive.imu.stamps.tolist()


def test_simulated_drivers_give_the_tilt_of_a_gentle_swing(graph: Any) -> None:
    nodes = [graph.add(node) for node in compose(**graph.options(simulated=True))]
    names = [node.get_name() for node in nodes]
    assert names == [
        "estimation_node", "filter_node", "correction_node", "mpu6050_node", "encoder_node",
    ]  # fmt: skip
    tilts, raw = graph.collect(Float64, "tilt"), graph.collect(Imu, "imu/data_raw")
    graph.spin_until(lambda: len(tilts) >= 500 and len(raw) >= 500)
    # The simulated robot swings by 5 deg; a wrong axis or sign would leave that range.
    assert 0.02 < max(abs(each.data) for each in tilts) < 0.12
    assert len({each.data for each in tilts}) > 100


def test_missing_devices_leave_the_rest_alive(graph: Any) -> None:
    nodes = [graph.add(node) for node in compose(**graph.options(mpu6050__bus=97))]
    tilts, valid = graph.collect(Float64, "tilt"), graph.collect(Bool, "tilt/valid")
    graph.spin_until(lambda: len(valid) >= 3)
    assert not tilts and not any(each.data for each in valid)
    assert not nodes[3].is_open and "97" in nodes[3].failure


def test_a_controller_in_the_process_balances_by_direct_calls(graph: Any) -> None:
    given = {"control": True, "drivers": False, "use_sim_time": True, "predict": False}
    patient = {"clock_timeout": 60.0}  # in lockstep, time is that of `/clock`
    lossless = graph.lossless("imu/data_raw", "joint_states", "cmd_vel")
    nodes = [graph.add(node) for node in compose(**graph.options(**given, **patient, **lossless))]
    controller = next(node for node in nodes if node.get_name() == "controller_node")
    heard = {each.topic_name for each in controller.subscriptions}
    assert not heard & {"/tilt", "/tilt/valid", "/imu/data", "/joint_states"}
    rig = SimulatedRobot("ideal", 5, 0.005, disturbed=False, stay_down=True, command_delay=0.005)
    rig.place(0.02)
    robot = SimulatedTopics(graph, rig)
    graph.settle()
    assert upright(robot.run(1.0))
    rig.push(3.0)
    assert upright(robot.run(2.0))
    assert controller.report().message == "balancing with pid"


def test_an_error_of_that_controller_leaves_the_tilt_alone(graph: Any, sensors: Any) -> None:
    lossless = graph.lossless("imu/data_raw", "joint_states", published=("tilt",))
    nodes = [
        graph.add(node)
        for node in compose(**graph.options(drivers=False, control=True, **lossless))
    ]
    controller = next(node for node in nodes if node.get_name() == "controller_node")
    controller._take = None  # whatever a defect may do
    tilts = graph.collect(Float64, "tilt")
    graph.settle()
    sensors.play(sensors.drive(50))
    graph.spin_until(lambda: len(tilts) == 50)
    assert controller.callback_errors.counts["tilt"] == 50
