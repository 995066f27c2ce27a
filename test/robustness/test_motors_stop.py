"""Every cause stops the motors: processes as a robot has them, checked by a client of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
from reliability.fed_controller import FedController
from std_msgs.msg import Bool

LIMIT = 0.055
"""`tilt_timeout` plus one `period`, the defaults [s]."""
SLACK = 0.5
"""For a loaded machine [s]; counted commands say what time cannot."""
PROGRAM = "import sys; from twbr_estimation.nodes.controller_node import main; sys.exit(main())"


@pytest.fixture
def robot(graph: Any) -> FedController:
    return FedController(graph)


@pytest.fixture
def controller(python: str, robot: FedController) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen([python, "-c", PROGRAM], start_new_session=True)
    robot.until(robot.drives, 60.0)
    yield process
    process.kill()
    process.wait(10)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_them_before_the_node_ends(
    controller: subprocess.Popen[bytes], robot: FedController, number: signal.Signals
) -> None:
    controller.send_signal(number)
    if number is signal.SIGHUP:
        controller.send_signal(number)  # the terminal's, then its shell's
    robot.until(lambda: controller.poll() is not None)
    assert controller.returncode == 0
    assert not robot.drives() and robot.commands[-1][1] == (0.0, 0.0)


@pytest.mark.parametrize(
    "how",
    [{"age": 1.0}, {"age": -2.0}, {"age": 1e6}, {"frozen": True}],
    ids=["stale", "ahead", "another clock", "frozen"],
)
def test_a_tilt_that_is_none_stops_them(
    controller: subprocess.Popen[bytes], robot: FedController, how: dict[str, Any]
) -> None:
    cause, count = time.monotonic(), robot.count
    robot.until(lambda: not robot.drives(), **how)
    assert robot.count - count <= 20 + SLACK / 0.005
    robot.until(lambda: robot.count >= count + 250, **how)
    assert not any(map(any, robot.since(cause + LIMIT + SLACK)))
    robot.until(robot.drives, 3.0 + 20.0 * SLACK)  # the lean is upright enough: it is stood up


def test_silence_and_a_stuck_executor_stop_them(
    controller: subprocess.Popen[bytes], robot: FedController
) -> None:
    cause = time.monotonic()
    robot.graph.spin_until(lambda: not robot.drives())
    assert robot.stopped_after(cause) < LIMIT + SLACK
    robot.until(robot.drives)


def test_what_is_not_valid_stops_them(
    controller: subprocess.Popen[bytes], robot: FedController
) -> None:
    robot.valid.publish(Bool(data=False))
    robot.until(lambda: not robot.drives())
    robot.valid.publish(Bool(data=True))
    robot.until(robot.drives)


STUCK = """
import sys, threading, time
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.spin import run

class Stuck(ControllerNode):
    def _on_joints(self, data):
        if self._stream.counts["steps"] > 200:
            lock = threading.Lock()
            with lock:
                lock.acquire()
        super()._on_joints(data)

sys.exit(run(Stuck))
"""


def test_a_callback_that_never_returns_stops_them(python: str, robot: FedController) -> None:
    process = subprocess.Popen([python, "-c", STUCK], stderr=subprocess.DEVNULL)
    try:
        robot.until(robot.drives, 60.0)
        robot.until(lambda: not robot.drives(), 30.0)
        start = time.monotonic()
        robot.until(lambda: time.monotonic() > start + 0.5)
        later = robot.since(start)
        assert len(later) >= 2 and not any(map(any, later)), "zeros are repeated"
    finally:
        process.kill()
        process.wait(10)


def test_a_simulated_clock_that_falls_silent_stops_them(python: str, graph: Any) -> None:
    robot = FedController(graph, simulated_time=True)
    command = [python, "-c", PROGRAM, "--ros-args", "-p", "use_sim_time:=true"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        robot.until(robot.drives, 60.0)
        cause = time.monotonic()
        robot.wait(1.0)
        assert robot.commands and not robot.drives()
        assert robot.stopped_after(cause) < LIMIT + SLACK
        robot.until(robot.drives)
    finally:
        process.kill()
        process.wait(10)


def test_without_a_clock_nothing_moves(python: str, robot: FedController) -> None:
    command = [python, "-c", PROGRAM, "--ros-args", "-p", "use_sim_time:=true"]
    process = subprocess.Popen(command, env=os.environ, stderr=subprocess.DEVNULL)
    try:
        robot.until(lambda: len(robot.commands) > 200, 60.0)
        assert not any(any(each) for _, each, _ in robot.commands)
    finally:
        process.kill()
        process.wait(10)
