"""The driver nodes themselves on device files of a real kernel, with ROS where it is installed."""

from __future__ import annotations

import errno
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ROS 2")

from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402

from hardware.transfers import Adapter  # noqa: E402
from twbr_estimation.nodes.encoder_node import EncoderNode  # noqa: E402
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node  # noqa: E402
from twbr_estimation.nodes.spin import make_executor  # noqa: E402

LONGEST_WAIT = 60.0
"""Ends a failing test [s]."""


class Spinner:
    """Nodes in one executor, spun by the test's thread."""

    def __init__(self) -> None:
        rclpy.init(args=["--ros-args", "-p", "autostart:=false"])
        self.executor = make_executor()
        self.listener = rclpy.create_node("listener")
        self.executor.add_node(self.listener)
        self.nodes = [self.listener]

    def add(self, kind: Callable[..., Any], **parameters: Any) -> Any:
        given = {name.replace("__", "."): value for name, value in parameters.items()}
        options = [Parameter(name, value=value) for name, value in given.items()]
        node = kind(parameter_overrides=options)
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def collect(self, kind: Any, topic: str) -> list[Any]:
        found: list[Any] = []
        self.listener.create_subscription(kind, topic, found.append, 100)
        return found

    def until(self, reached: Callable[[], Any]) -> None:
        end = time.monotonic() + LONGEST_WAIT
        while not reached():
            assert time.monotonic() < end, "it did not come"
            self.executor.spin_once(timeout_sec=0.1)

    def close(self) -> None:
        for node in self.nodes:
            node.destroy_node()
        self.executor.shutdown()
        rclpy.shutdown()


@pytest.fixture
def spinner() -> Iterator[Spinner]:
    made = Spinner()
    yield made
    made.close()


def _torn(messages: list[Imu]) -> int:
    """Count messages whose specific force is not that of a robot that swings gently."""
    forces = [each.linear_acceleration for each in messages]
    return sum(not 9.0 < math.hypot(each.x, each.y, each.z) < 10.6 for each in forces)


@pytest.mark.parametrize("reading", ["burst", "fifo"])
def test_mpu6050_node_publishes_what_is_on_the_bus(
    bus: tuple[int, Adapter], spinner: Spinner, reading: str
) -> None:
    received = spinner.collect(Imu, "imu/data_raw")
    node = spinner.add(Mpu6050Node, mpu6050__bus=bus[0], mpu6050__reading=reading,
                       mpu6050__poll_rate=50.0)  # fmt: skip
    node.trigger_configure()
    assert node.is_open, node.failure
    assert not received, "inactive"
    node.trigger_activate()
    spinner.until(lambda: len(received) > 50)
    read, stalls = bus[1].chip.read, [1]

    def stall(register: int, length: int) -> bytes:
        if register in (0x3B, 0x74) and stalls and stalls.pop():
            time.sleep(0.5)
        return bytes(read(register, length))

    bus[1].chip.read = stall  # type: ignore[method-assign]
    before = len(received)
    spinner.until(lambda: not stalls and len(received) > before + 50)
    assert node.reader.running
    assert (node.reader.counters.fifo_overflows > 0) == (reading == "fifo")
    assert _torn(received) == 0


def test_mpu6050_node_opens_a_lost_bus_again(bus: tuple[int, Adapter], spinner: Spinner) -> None:
    received = spinner.collect(Imu, "imu/data_raw")
    node = spinner.add(Mpu6050Node, mpu6050__bus=bus[0], mpu6050__poll_rate=50.0, autostart=True)
    spinner.until(lambda: received)
    bus[1].error = errno.EREMOTEIO
    spinner.until(lambda: not node.is_open)
    errors = node._counters.bus_errors
    assert errors > 5
    bus[1].error = 0
    received.clear()
    spinner.until(lambda: len(received) > 20)
    assert node.reader.counters.bus_errors >= errors, "the counters go on"


def test_mpu6050_node_waits_for_a_chip_that_a_driver_holds(
    bus: tuple[int, Adapter], spinner: Spinner
) -> None:
    adapter = Path(f"/sys/bus/i2c/devices/i2c-{bus[0]}")
    if not adapter.exists():
        pytest.skip("only i2c-dev has drivers beside it")
    (adapter / "new_device").write_text("dummy 0x68")
    try:
        node = spinner.add(Mpu6050Node, mpu6050__bus=bus[0], autostart=True)
        assert "a kernel driver holds the chip at 0x68" in node.failure
        assert not node.is_open
    finally:
        (adapter / "delete_device").write_text("0x68")
    spinner.until(lambda: node.is_active)


@pytest.mark.parametrize("counter", ["rig-eqep"], indirect=True)
def test_encoder_node_publishes_a_kernel_counter(counter: Path, spinner: Spinner) -> None:
    received = spinner.collect(JointState, "joint_states")
    spinner.add(
        EncoderNode,
        counters=[str(counter)],
        joint_names=["wheel"],
        encoder__counts_per_turn=1000,
        poll_rate=50.0,
        autostart=True,
    )
    spinner.until(lambda: received)
    start, first = received[-1].position[0], int((counter / "count").read_text())
    (counter / "count").write_text(str((first + 250) % 2**32))
    spinner.until(lambda: abs(received[-1].position[0] - start - 1.5708) < 1e-3)
