"""The mounting of a live robot from its frames."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped

from twbr_estimation.configuration.urdf import urdf
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.robot import Robot

TURNED = Robot(mounting=(0.0, 0.0, 1.5), lever_arm=(0.0, 0.01, 0.08))


def node_with(graph: Any, **values: str) -> CorrectionNode:
    parameters = {f"mounting__{name}": value for name, value in values.items()}
    return graph.add(CorrectionNode(**graph.options(**parameters)))


def test_a_urdf_sets_mounting_and_lever_arm(graph: Any, tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(urdf(TURNED), encoding="utf-8")
    node = node_with(graph, urdf_file=str(file), body_frame="base_link", axle_frame="base_link")
    assert list(node.get_parameter("robot.mounting").value) == pytest.approx(TURNED.mounting)
    assert list(node.get_parameter("robot.lever_arm").value) == pytest.approx(TURNED.lever_arm)


def test_transforms_set_the_mounting_once_they_connect(graph: Any) -> None:
    node = node_with(graph, body_frame="base_link", sensor_frame="chip")
    frames = node._mounting
    assert "as configured" in frames.problem
    before = list(node.get_parameter("robot.mounting").value)

    def message(parent: str, child: str) -> Any:
        each = TransformStamped(child_frame_id=child)
        each.header.frame_id = parent
        each.transform.rotation.x, each.transform.rotation.w = 1.0, 0.0
        return SimpleNamespace(transforms=[each])

    frames.take(message("board", "chip"))
    assert "not connected" in frames.problem
    assert list(node.get_parameter("robot.mounting").value) == before
    frames.take(message("base_link", "board"))
    assert frames.problem == ""
    assert list(node.get_parameter("robot.mounting").value) == pytest.approx([0.0, 0.0, 0.0])
