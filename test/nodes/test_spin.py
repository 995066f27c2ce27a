"""Starting and stopping a process of nodes."""

from __future__ import annotations

import signal
import subprocess
from contextlib import suppress

import pytest

pytestmark = pytest.mark.usefixtures("domain")

PROGRAM = """
import sys
from rclpy.node import Node
from twbr_estimation.errors import SensorError
from twbr_estimation.nodes.spin import run

class Subject(Node):
    def __init__(self):
        super().__init__("subject")
        self.create_timer(0.01, self.tick)

    def tick(self):
        {tick}

    def destroy_node(self):
        print("destroyed", flush=True)
        super().destroy_node()

sys.exit(run(Subject))
"""


def _start(python: str, tick: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [python, "-c", PROGRAM.format(tick=tick)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_cleanly(python: str, number: signal.Signals) -> None:
    process = _start(python, 'print("tick", flush=True)')
    assert process.stdout is not None
    assert process.stdout.readline() == "tick\n"
    process.send_signal(number)
    output, errors = process.communicate(timeout=20)
    assert process.returncode == 0, errors
    assert output.endswith("destroyed\n")
    assert "Traceback" not in errors


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_never_ends_the_context_under_a_publisher(
    python: str, number: signal.Signals
) -> None:
    tick = """if not hasattr(self, "publisher"):
            from std_msgs.msg import Float64
            self.publisher, self.message = self.create_publisher(Float64, "x", 10), Float64()
            print("tick", flush=True)
        for _ in range(1000):
            self.publisher.publish(self.message)"""
    process = _start(python, tick)
    assert process.stdout is not None
    assert process.stdout.readline() == "tick\n"
    process.send_signal(number)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 0
    assert errors == ""


@pytest.mark.parametrize(
    ("tick", "status", "said"),
    [
        ("raise SystemExit(3)", 3, ""),
        ("raise SensorError('no answer from 0x68')", 1, "no answer from 0x68"),
    ],
)
def test_a_node_can_end_its_process(python: str, tick: str, status: int, said: str) -> None:
    process = _start(python, tick)
    output, errors = process.communicate(timeout=20)
    assert process.returncode == status, errors
    assert output.endswith("destroyed\n")
    assert said in errors and "Traceback" not in errors


def test_more_signals_during_the_end_change_nothing(python: str) -> None:
    process = _start(python, 'print("tick", flush=True)')
    assert process.stdout is not None
    assert process.stdout.readline() == "tick\n"
    for _ in range(200):
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.005)
            break
    output, errors = process.communicate(timeout=20)
    assert process.returncode == 0, errors
    assert output.endswith("destroyed\n")
    assert "Traceback" not in errors and "Aborted" not in errors
