"""The nodes among what `bench/instructions.py` counts, and a process that listens to them."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from instruction_subjects import (
    FIRST,
    MILLISECOND,
    Run,
    StoredChip,
    StoredCounter,
    corrected_samples,
)
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64, Float64MultiArray

from twbr_estimation.live_code.providing import background_steps
from twbr_estimation.nodes.estimation_node import compose
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.guard import Guard
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node
from twbr_estimation.nodes.spin import make_executor
from twbr_estimation.streams.corrected import imu_values
from twbr_estimation.streams.messages import ImuEncoder, encode_float64

TOPICS = {"tilt": Float64, "imu/data_raw": Imu, "motor/command": Float64MultiArray}
DISCOVERY = 120.0
"""Longest time until a listener has been found [s]."""
STALE = 0.5
"""Time after which a node without input reports so; that is logged once, which takes long [s]."""


def begin(**parameters: Any) -> dict[str, Any]:
    """Start rclpy; return the options of nodes with these parameters."""
    rclpy.init(args=["--ros-args", "--log-level", "warn"])
    values = {name.replace("__", "."): value for name, value in parameters.items()}
    return {"parameter_overrides": [Parameter(name, value=each) for name, each in values.items()]}


def listened_to(node: Node, topic: str) -> None:
    """Let another process listen to a topic, and wait until it does."""
    listener = subprocess.Popen([sys.executable, __file__, topic, str(os.getpid())])
    end = time.monotonic() + DISCOVERY
    while not node.count_subscribers(topic):
        assert listener.poll() is None and time.monotonic() < end, "no listener"
        time.sleep(0.2)


def listen(topic: str, parent: int) -> None:
    """Listen until the parent process ends."""
    rclpy.init()
    node = Node("listener")
    node.create_subscription(TOPICS[topic], topic, lambda data: None, 10, raw=True)
    executor = make_executor()
    executor.add_node(node)
    while os.getppid() == parent:
        executor.spin_once(timeout_sec=0.5)


def _repeated(action: Callable[[], Any]) -> Run:
    def run(count: int) -> None:
        for _ in range(count):
            action()

    return run


def encode() -> Run:
    """Encode an Imu and a Float64."""
    encoder = ImuEncoder("imu_link")
    sample = next(corrected_samples(0.005))

    def both() -> None:
        encode_float64(0.1)
        encoder.encode(FIRST, imu_values(sample, 0.1, 1e-4, 0.2))

    return _repeated(both)


def publish_to_nobody() -> Run:
    """Publish a serialised Float64 that nobody listens to."""
    begin()
    publisher = Node("bench").create_publisher(Float64, "tilt", 100)
    data = encode_float64(0.1)
    return _repeated(lambda: publisher.publish(data))


def publish() -> Run:
    """Publish a serialised Float64 to another process."""
    begin()
    node = Node("bench")
    publisher = node.create_publisher(Float64, "tilt", 100)
    listened_to(node, "tilt")
    data = encode_float64(0.1)
    return _repeated(lambda: publisher.publish(data))


def executor_turn() -> Run:
    """Call a timer of a node that does nothing."""
    begin()
    node, executor = Node("bench"), make_executor()
    calls = [0]

    def tick() -> None:
        calls[0] += 1

    node.create_timer(1e-6, tick)
    executor.add_node(node)

    def run(count: int) -> None:
        end = calls[0] + count
        while calls[0] < end:
            executor.spin_once(timeout_sec=0.1)

    return run


def filter_node_take() -> Run:
    """Filter a corrected sample, publish the tilt to another process."""
    node = FilterNode(subscribe=False, **begin())
    listened_to(node, "tilt")
    samples, stamps = corrected_samples(0.005), itertools.count(FIRST, 5 * MILLISECOND)
    return _repeated(lambda: node.take(next(stamps), next(samples)))


def diagnostics() -> Run:
    """Report the state of the filter node."""
    node = FilterNode(subscribe=False, **begin())
    samples, stamps = corrected_samples(0.005), itertools.count(FIRST, 5 * MILLISECOND)
    for _ in range(400):
        node.take(next(stamps), next(samples))
    time.sleep(STALE)
    node._diagnostics.update()
    return _repeated(node._diagnostics.update)


def watchdog() -> Run:
    """Look whether the input of the filter node is fresh, and publish `tilt/valid`."""
    return _repeated(FilterNode(subscribe=False, **begin())._tick)


class _Clock:
    """The clock of all nodes, which advances by a period a turn; asking for it costs as much."""

    def __init__(self) -> None:
        self.now = FIRST
        own = Guard.clock_now
        Guard.clock_now = lambda node: own(node) and self.now  # type: ignore[method-assign]


def _polled(nodes: Sequence[Any], clock: _Clock, period: int) -> Run:
    drivers = [each for each in nodes if hasattr(each, "_poll")]
    chips = [each for each in drivers if isinstance(each, Mpu6050Node)]
    assert all(each.is_active for each in drivers)

    def turn() -> None:
        clock.now += period
        for driver in reversed(drivers):  # the wheels first
            driver._poll()

    def run(count: int) -> None:
        for _ in range(count):
            turn()
        started_again = [each.reader.counters.reinitialisations for each in chips]
        assert not any(started_again), "the chip was set up again: turns without samples"

    return run


def mpu6050_burst() -> Run:
    """Read a packet in the node and publish it to another process."""
    clock, options = _Clock(), begin(mpu6050__poll_rate=500.0)
    node = Mpu6050Node(StoredChip(0.002), **options)
    listened_to(node, "imu/data_raw")
    return _polled([node], clock, 2 * MILLISECOND)


def _estimation(topic: str, period: int, **parameters: Any) -> tuple[Run, list[Any]]:
    clock = _Clock()
    nodes = compose(
        registers=StoredChip(parameters.pop("sampled")),
        counters=[StoredCounter(period * 1e-9) for _ in range(2)],
        **begin(poll_rate=1e9 / period, mpu6050__poll_rate=1e9 / period, **parameters),
    )
    listened_to(nodes[0], topic)
    while not background_steps().ready:
        time.sleep(0.1)
    for each in nodes:
        if hasattr(each, "_code"):
            each._code.look()
    return _polled(nodes, clock, period), nodes


COMBINED = {"mpu6050__reading": "fifo", "loop_period": 0.005, "sampled": 0.001}


def estimation() -> Run:
    """Read FIFO and encoders, correct five samples, filter their combination, publish the tilt."""
    return _estimation("tilt", 5 * MILLISECOND, **COMBINED)[0]


def estimation_interpreted() -> Run:
    """Do the same without machine code."""
    return _estimation("tilt", 5 * MILLISECOND, machine_code=False, **COMBINED)[0]


def estimation_burst() -> Run:
    """Read, correct and filter one sample of 500 Hz and two encoders, publish the tilt."""
    return _estimation("tilt", 2 * MILLISECOND, sampled=0.002)[0]


def estimation_control() -> Run:
    """Do what `estimation` does, with the controller in the same process."""
    # Preparing every controller happens once, in the background: it may fall into the count.
    given = {**COMBINED, "control": True, "prepare_all": False}
    run, nodes = _estimation("motor/command", 5 * MILLISECOND, **given)
    controller = next(each for each in nodes if each.get_name() == "controller_node")

    def checked(count: int) -> None:
        run(count)
        assert controller.report().message.startswith("balancing"), controller.report()

    run(400)
    return checked


NODES: dict[str, Callable[[], Run]] = {
    part.__name__: part
    for part in (
        encode,
        publish_to_nobody,
        publish,
        executor_turn,
        filter_node_take,
        diagnostics,
        watchdog,
        mpu6050_burst,
        estimation,
        estimation_interpreted,
        estimation_burst,
        estimation_control,
    )
}

if __name__ == "__main__":
    listen(sys.argv[1], int(sys.argv[2]))
