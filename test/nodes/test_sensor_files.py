"""The parameter files of the sensors' nodes, taken by the nodes as they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from twbr_estimation.nodes.encoder_node import EncoderNode
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node, Mpu6050NodeSettings
from twbr_estimation.robot import Robot
from twbr_estimation.sensors.joint_encoders import Role
from twbr_estimation.sensors.mpu6050 import Reading

CONFIG = Path(__file__).resolve().parents[2] / "config"


def _node(graph: Any, kind: Any, file: str, *arguments: str) -> Any:
    command = ["--ros-args", "--params-file", str(CONFIG / file), *arguments]
    return graph.add(kind(**graph.options(autostart=False), cli_args=command))


@pytest.mark.parametrize("namespace", ["/", "/robot"])
def test_the_file_of_the_chip_has_the_defaults(graph: Any, namespace: str) -> None:
    node = _node(graph, Mpu6050Node, "mpu6050.yaml", "-r", f"__ns:={namespace}")
    chip, default = node.parameters.current.mpu6050, Mpu6050NodeSettings().mpu6050
    for name in ("gyro_range_deg", "accel_range_g", "dlpf_config", "sample_rate", "reading"):
        assert getattr(chip, name) == getattr(default, name)
    assert chip.gyro_stddev == 0.00178


def test_the_set_up_of_the_paper_is_a_preset(graph: Any) -> None:
    chip = _node(graph, Mpu6050Node, "mpu6050_laddach2022.yaml").parameters.current.mpu6050
    assert (chip.gyro_range, chip.accel_range) == (Robot().gyro_range, Robot().accel_range)


@pytest.mark.parametrize(
    ("file", "agree"), [("mpu6050.yaml", True), ("mpu6050_laddach2022.yaml", False)]
)
def test_the_ranges_of_robot_and_chip_are_compared(graph: Any, file: str, agree: bool) -> None:
    also = ("--params-file", str(CONFIG / "robot.yaml"))
    settings = _node(graph, Mpu6050Node, file, *also).parameters.current
    assert settings.robot.gyro_range > 0.0
    assert (settings.robot.difference(settings.mpu6050) == "") is agree


def test_the_fifo_file_reads_every_sample(graph: Any) -> None:
    chip = _node(graph, Mpu6050Node, "mpu6050_fifo.yaml").parameters.current.mpu6050
    assert chip.reading is Reading.FIFO
    assert chip.delivered_rate == 1000.0


def test_wheels_and_reference_share_a_file(graph: Any) -> None:
    wheels = _node(graph, EncoderNode, "encoders.yaml").parameters.current
    renamed = ("-r", "__node:=reference_encoder_node")
    reference = _node(graph, EncoderNode, "encoders.yaml", *renamed).parameters.current
    assert wheels.role is Role.WHEELS
    assert wheels.signs == (1, -1)
    assert wheels.encoder.gear_ratio == 30.0
    assert reference.role is Role.REFERENCE
    assert reference.joints == ("tilt",)
    assert reference.encoder.counts_per_turn == 2000
