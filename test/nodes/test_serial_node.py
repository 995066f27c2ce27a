"""The serial port of a microcontroller, over a pseudo-terminal."""

from __future__ import annotations

import os
import pty
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
pytest.importorskip("serial", reason="needs the extra serial")
pytest.importorskip("cobs", reason="needs the extra serial")

import itertools

from sensor_msgs.msg import Imu, JointState

from twbr_estimation.nodes.serial_node import SerialNode
from twbr_estimation.streams.device.binary_frames import DeviceSample, encode_frame

TICKS = 10
"""Between two samples [us]: all of them together are shorter than a test takes to send them."""


class Terminal:
    """The device's end of a pseudo-terminal, under a name that stays."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug_in()

    def plug_in(self) -> None:
        self.device, computer = pty.openpty()
        tty.setraw(computer)
        self.link.symlink_to(os.ttyname(computer))
        self._computer = computer

    def unplug(self) -> None:
        self.link.unlink()
        os.close(self.device)
        os.close(self._computer)

    def send(self, data: bytes) -> None:
        os.write(self.device, data)


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    return Terminal(tmp_path / "port")


def frame(number: int) -> bytes:
    return encode_frame(
        DeviceSample(TICKS * number, (0.1, 0.2, 0.3), (0.0, 0.0, 9.8), (0.001 * number, 0.0))
    )


def test_frames_are_published_with_stamps_of_the_device(graph: Any, terminal: Terminal) -> None:
    graph.add(SerialNode(**graph.options(port=str(terminal.link), format="frames")))
    imu, wheels = graph.collect(Imu, "imu/data_raw"), graph.collect(JointState, "joint_states")
    graph.settle()
    for batch in (range(100), range(100, 200)):
        terminal.send(b"".join(map(frame, batch)))
        graph.spin_until(lambda: len(imu) >= batch.stop and len(wheels) >= batch.stop)  # noqa: B023
    assert [each.angular_velocity.y for each in imu] == pytest.approx([0.2] * 200)
    assert imu[0].orientation_covariance[0] == -1.0
    assert list(wheels[50].name) == ["left_wheel_joint", "right_wheel_joint"]
    assert wheels[50].position[0] == pytest.approx(0.05)
    stamps = [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in imu]
    # Written at once; on the device's clock they are apart.
    steps = [b - a for a, b in itertools.pairwise(stamps[100:])]
    assert steps == pytest.approx([1000 * TICKS] * 99, abs=2)


def test_lines_are_published_as_described(graph: Any, terminal: Terminal, tmp_path: Path) -> None:
    description = tmp_path / "columns.yaml"
    description.write_text(
        "columns: {time: t, gyro: [null, g, null], accel: [x, null, z], wheels: w}\n"
        "units: {time: ms, gyro: deg/s, accel: g, wheels: deg}\n"
    )
    graph.add(SerialNode(**graph.options(port=str(terminal.link), description=str(description))))
    imu, wheels = graph.collect(Imu, "imu/data_raw"), graph.collect(JointState, "joint_states")
    graph.settle()
    terminal.send(b"rubbish of a line that began earlier\nt,g,x,z,w\n")
    for number in range(20):
        terminal.send(b"%d,180,0.5,1,90\n" % number)
    terminal.send(b"20,18\xff,0.5,1,90\n21,180,0.5\n")
    graph.spin_until(lambda: len(imu) >= 20 and len(wheels) >= 20)
    assert imu[0].angular_velocity.y == pytest.approx(3.14159265)
    assert imu[0].linear_acceleration.x == pytest.approx(0.5 * 9.80665)
    assert list(wheels[0].name) == ["wheel_joint"]
    assert wheels[0].position[0] == pytest.approx(1.5707963)


def test_a_port_that_was_unplugged_is_opened_again(graph: Any, terminal: Terminal) -> None:
    node = graph.add(SerialNode(**graph.options(port=str(terminal.link), format="frames")))
    imu = graph.collect(Imu, "imu/data_raw")
    graph.settle()
    terminal.send(frame(0) + frame(1))
    graph.spin_until(lambda: len(imu) == 2)
    terminal.unplug()
    graph.spin_until(lambda: not node.is_open)
    assert str(terminal.link) in node.report().message
    terminal.plug_in()
    graph.spin_until(lambda: node.is_active)
    graph.settle()
    terminal.send(frame(2))
    graph.spin_until(lambda: len(imu) == 3)


def test_a_port_without_data_is_an_error_in_words(graph: Any, terminal: Terminal) -> None:
    node = graph.add(SerialNode(**graph.options(port=str(terminal.link), format="frames")))
    graph.spin_until(lambda: node.is_settled)
    report = node.report()
    assert report.level.name == "ERROR"
    assert "no sample: nothing comes" in report.message


def test_a_missing_port_and_a_missing_description_are_named(graph: Any, tmp_path: Path) -> None:
    node = graph.add(SerialNode(**graph.options(port=str(tmp_path / "none"), format="frames")))
    assert not node.is_open
    assert f"{tmp_path / 'none'}: cannot be opened" in node.report().message
    lines = graph.add(SerialNode(**graph.options(port="/dev/null")))
    assert "description: with format `lines` a YAML file is needed" in lines.report().message
