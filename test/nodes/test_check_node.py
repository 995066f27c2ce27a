"""The acceptance test over real middleware: a simulated robot, good and with a mirrored wheel."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import JointState

from twbr_estimation.nodes.check_node import CheckNode
from twbr_estimation.ros_messages import set_stamp
from twbr_estimation.simulation import simulate

START = 5_000_000_000


def play(graph: Any, sensors: Any, signs: tuple[float, float]) -> None:
    """Publish a drive; the node under test ends it."""
    recording = simulate("W4", 0.01, 30.0, 511).recording
    imu, wheels = recording.imu, recording.wheels
    assert wheels is not None
    publisher = graph.probe.create_publisher(JointState, "joint_states", 2000)
    graph.settle()
    begin = START - int(imu.stamps[0])
    columns = zip(imu.stamps.tolist(), imu.gyro.tolist(), imu.accel.tolist(), strict=True)
    turns = list(zip(wheels.stamps.tolist(), (wheels.angle * signs).tolist(), strict=True))
    for stamp, gyro, accel in columns:
        while turns and turns[0][0] <= stamp:
            when, angle = turns.pop(0)
            message = JointState(name=["left_wheel_joint", "right_wheel_joint"], position=angle)
            set_stamp(message, begin + when)
            publisher.publish(message)
        sensors.imu(begin + stamp, tuple(gyro), tuple(accel))
        graph.executor.spin_once(timeout_sec=0.0)


@pytest.mark.parametrize(("signs", "status"), [((1.0, 1.0), 0), ((-1.0, 1.0), 1)])
def test_it_ends_with_the_table_and_a_status(
    graph: Any,
    sensors: Any,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    signs: tuple[float, float],
    status: int,
) -> None:
    file = tmp_path / "found.json"
    options = graph.options(
        ask=False,
        json_file=str(file),
        **graph.lossless("imu/data_raw", "joint_states"),
    )
    node = graph.add(CheckNode(**options))
    play(graph, sensors, signs)
    graph.spin_until(lambda: node.status is not None)
    printed = capsys.readouterr().out
    failed = [
        each for each in json.loads(file.read_text())["findings"] if each["severity"] == "FAIL"
    ]
    assert node.status == status == len(failed) and "PASS" in printed
    assert ("signs: [-1, 1]" in printed) is bool(status)
    assert node.acceptance.ended


def test_it_asks_and_says_so_in_the_diagnostics(graph: Any, sensors: Any) -> None:
    node = graph.add(CheckNode(**graph.options()))
    graph.settle()
    assert "waiting for imu/data_raw" in node.report().message
    sensors.imu(START, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8))
    graph.spin_until(lambda: "leave it at rest" in node.report().message)


def test_it_ends_where_no_data_come(graph: Any) -> None:
    ended: list[bool] = []
    node = graph.add(CheckNode(lambda: ended.append(True), **graph.options(patience=1.0)))
    graph.spin_until(lambda: bool(ended))
    assert node.status == 1 and "no usable sample" in node.report().message


@pytest.mark.usefixtures("domain")
def test_the_process_ends_with_the_status_and_without_a_traceback(python: str) -> None:
    program = "import sys; from twbr_estimation.nodes.check_node import main; sys.exit(main())"
    result = subprocess.run(
        [python, "-c", program, "--ros-args", "-p", "patience:=1.0"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert result.returncode == 1 and "FAIL" in result.stdout
    assert "Traceback" not in result.stderr and "Error occurred" not in result.stderr
