"""A robot that is not the same in all nodes is said in the diagnostics of `filter_node`."""

from __future__ import annotations

import json
import math
import time
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node
from twbr_estimation.nodes.robot_agreement import (
    CHIP,
    FORGOTTEN,
    MOST_NODES,
    ROBOT,
    RobotAgreement,
    stated,
    stated_ranges,
)
from twbr_estimation.robot import Robot

OWN = Robot(wheel_radius=0.04)


@pytest.fixture
def agreement(graph: Any) -> RobotAgreement:
    return RobotAgreement(graph.probe, lambda: OWN)


def test_nodes_of_one_robot_agree(agreement: RobotAgreement) -> None:
    agreement.note("controller_node", ROBOT, stated(OWN), 10.0)
    agreement.note("mpu6050_node", CHIP, stated_ranges(OWN.gyro_range, OWN.accel_range), 10.0)
    mounted = Robot(wheel_radius=0.04, mounting=(0.0, 0.1, 0.0))
    agreement.note("correction_node", ROBOT, stated(mounted), 10.0)
    assert agreement.problem(10.0) == ""


def test_what_differs_is_named_with_its_node_until_that_ends(agreement: RobotAgreement) -> None:
    agreement.note("controller_node", ROBOT, stated(Robot(lever_arm=(0.0, 0.0, 0.05))), 10.0)
    agreement.note("mpu6050_node", CHIP, stated_ranges(math.radians(1000), OWN.accel_range), 12.0)
    found = agreement.problem(12.0)
    assert "robot.wheel_radius, robot.lever_arm of controller_node" in found
    assert "robot.gyro_range of mpu6050_node" in found and "accel_range" not in found
    assert "robot.yaml" in found
    assert "controller_node" not in agreement.problem(10.0 + FORGOTTEN)
    assert agreement.problem(12.0 + FORGOTTEN) == ""


@pytest.mark.parametrize("text", ["", "7", "[" * 100_000, "{", '{"wheel_radius": "x"}', "null"])
def test_nonsense_ends_nothing(agreement: RobotAgreement, text: str) -> None:
    agreement.note("n", ROBOT, text, 1.0)
    agreement.note("n", CHIP, text, 1.0)
    assert isinstance(agreement.problem(1.0), str)


def test_names_without_end_take_no_memory_without_end(agreement: RobotAgreement) -> None:
    for index in range(1000):
        agreement.note(f"n{index}", ROBOT, json.dumps({"wheel_radius": 0.01}), 1.0)
    assert agreement.problem(1.0).count("wheel_radius") == MOST_NODES


def test_filter_node_says_what_live_nodes_differ_in(graph: Any) -> None:
    tilt = graph.add(FilterNode(**graph.options(robot__track_width=0.2)))
    graph.add(CorrectionNode(**graph.options(robot__track_width=0.2)))
    graph.add(ControllerNode(**graph.options(robot__track_width=0.3, prepare_all=False)))
    graph.add(Mpu6050Node(**graph.options(simulated=True)))

    def said() -> str:
        return tilt._agreement.problem(time.monotonic())

    graph.spin_until(lambda: "controller_node" in said() and "mpu6050_node" in said(), 60.0)
    graph.spin_until(lambda: "correction_node" in tilt._agreement._others, 60.0)
    assert "robot.track_width of controller_node" in said()
    assert "correction_node" not in said()
    assert "robot.gyro_range, robot.accel_range of mpu6050_node" in said()
