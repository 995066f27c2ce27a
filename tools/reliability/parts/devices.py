"""Devices that answer at random.

The drivers read a chip, counters and a serial port of which one answer in twenty fails, ends early
or holds anything. What they publish has to be finite and of now, and to flow again two seconds
after the device is sound.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from typing import Any

from reliability.all_nodes import drivers, serial_line
from reliability.graph import (
    Graph,
    callback_errors,
    error_lines,
    opened_graph,
    resident_megabytes,
    taped,
)
from reliability.parts.messages import GROWTH
from reliability.parts.transitions import brought_to_work
from reliability.random_devices import RandomBoard, RandomCounter, RandomRegisters
from reliability.row import Effort, Row
from twbr_estimation.nodes.encoder_node import EncoderNode
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050
from twbr_estimation.streams.messages import JointStateDecoder, decode_raw_imu

ANSWERS = 100_000
PERIOD = 5_000_000
"""Time between two polls [ns]."""
RECOVERY = 400
"""Polls in the two seconds in which a sound device has to deliver again."""
START = 1_700_000_000_000_000_000


class Watched:
    """What a driver publishes: how much, how much of it is not finite, and the newest stamp."""

    def __init__(self, decode: Callable[[bytes], tuple[int, float]]) -> None:
        """`decode`: returns stamp [ns] and sum of the numbers of a serialised message."""
        self._decode = decode
        self.published = self.not_finite = self.newest = 0

    def __call__(self, message: Any) -> None:
        """Take a message."""
        self.newest, total = self._decode(message)
        self.published += 1
        self.not_finite += not math.isfinite(total)


def imu_of(data: bytes) -> tuple[int, float]:
    """Return stamp and sum of the numbers of a serialised Imu."""
    stamp, values = decode_raw_imu(data)
    return stamp, math.fsum(values)


def joints_of(data: bytes) -> tuple[int, float]:
    """Return stamp and sum of the positions of a serialised JointState."""
    found = JointStateDecoder().decode(data)
    return found[0], math.fsum(found[2])


def rows(effort: Effort) -> Iterator[Row]:
    """Try each driver."""
    yield _chip(effort)
    yield _counters(effort)
    yield _port(effort)


def _chip(effort: Effort) -> Row:
    now = [START]
    with opened_graph() as graph:
        registers = RandomRegisters(SimulatedMpu6050(lambda: now[0], reset_time=0.0), effort.seed)
        given = graph.options(simulated=True, use_sim_time=True, autostart=False)
        node = graph.add(Mpu6050Node(registers, **given))
        watched = Watched(imu_of)
        taped(node._imu_publisher, watched)
        return _polled("chip", node, registers, watched, now, effort)


def _counters(effort: Effort) -> Row:
    now = [START]
    with opened_graph() as graph:
        counters = [RandomCounter(lambda: now[0], effort.seed + each) for each in range(2)]
        node = graph.add(EncoderNode(counters, **graph.options(simulated=True, autostart=False)))
        return _polled("counters", node, Both(counters), Watched(joints_of), now, effort)


class Both:
    """Several faulty devices that are made sound together."""

    def __init__(self, devices: list[Any]) -> None:
        """`devices`: each with `faults`."""
        self._devices = devices

    @property
    def faults(self) -> bool:
        """Whether there are any."""
        return any(each.faults for each in self._devices)

    @faults.setter
    def faults(self, faulty: bool) -> None:
        for each in self._devices:
            each.faults = faulty


def _polled(
    name: str, node: Any, device: Any, watched: Watched, now: list[int], effort: Effort
) -> Row:
    """Poll a driver, which is started again whenever it has lost its device."""
    node.clock_now = lambda: now[0]
    count, memory, reopened, worst = effort.tries(ANSWERS), 0.0, 0, 0
    for index in range(count + RECOVERY):
        device.faults = index < count
        if not node.is_active:
            reopened += _opened(node, watched)
        now[0] += PERIOD
        before = watched.published
        if node.is_active:
            node._poll()
        if watched.published > before:
            worst = max(worst, abs(watched.newest - now[0]))
        if index % 200 == 0:
            node._diagnostics.update()
        if 2 * index >= count and not memory:
            memory = resident_megabytes()
    return _row(name, count, node, watched, f"{reopened} times opened", memory, worst)


def _opened(node: Any, watched: Watched) -> bool:
    """Start a driver; return whether it works now."""
    works = brought_to_work(node)
    if works and isinstance(node, EncoderNode):
        taped(node._publisher, watched)
    elif works:
        node.reader._sleep = lambda seconds: None
    return works


def _row(
    name: str, count: int, node: Any, watched: Watched, opened: str, memory: float, worst: int
) -> Row:
    grown, failed = resident_megabytes() - memory, callback_errors([node])
    for what, times in error_lines([node]):
        print(f"  {times} times: {what}", flush=True)
    flows = watched.newest > 0 and node.is_active
    return Row(
        f"random answers of the {name}",
        count,
        "no end, no error, finite, stamps of now to 1 s, at work 2 s after",
        f"{failed} errors; {watched.not_finite} of {watched.published} messages not finite; stamps "
        f"at most {worst * 1e-9:.2f} s off; {opened}; {'at work' if flows else 'silent'} "
        f"at the end; {grown:+.1f} MB",
        failed == watched.not_finite == 0 and worst < 10**9 and flows and grown < GROWTH,
    )


def _port(effort: Effort) -> Row:
    with opened_graph() as graph, serial_line() as (device, port):
        node = _serial(graph, port)
        watched, board = Watched(imu_of), RandomBoard(effort.seed)
        brought_to_work(node)
        taped(node._imu, watched)
        joints = Watched(joints_of)
        taped(node._wheels, joints)
        count, memory, worst = effort.tries(ANSWERS), 0.0, 0
        for index in range(count + RECOVERY):
            os.write(device, board.frame() if index < count else board.sound())
            before = watched.published
            node._poll()
            if watched.published > before:
                worst = max(worst, abs(watched.newest - time.time_ns()))
            if index % 200 == 0:
                node._diagnostics.update()
            if 2 * index >= count and not memory:
                memory = resident_megabytes()
        watched.not_finite += joints.not_finite
        return _row("serial port", count, node, watched, "1 times opened", memory, worst)


def _serial(graph: Graph, port: Any) -> Any:
    return drivers(graph, port)[-1]
