"""Random messages.

All nodes that subscribe to anything get them as the middleware would deliver them, without its
losses. What they publish has to be finite, their memory may not grow, and the tilt has to be right
two seconds after sound readings return.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from reliability.graph import (
    Graph,
    Numbers,
    Wiretap,
    callback_errors,
    opened_graph,
    resident_megabytes,
    taped,
)
from reliability.random_messages import RandomMessages
from reliability.row import Effort, Row
from twbr_estimation.nodes.check_node import CheckNode
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.evaluator_node import EvaluatorNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.simulator_node import SimulatorNode
from twbr_estimation.streams.messages import decode_float64, decode_float64s, decode_imu

MESSAGES = 1_000_000
GROWTH = 10.0
"""Memory that the second half of the messages may add [MB]."""
LEAN, PERIOD, SETTLING = 0.1, 0.005, 2.0
"""Of the sound readings at the end: tilt [rad], period [s] and time left for the return [s]."""
AHEAD = 100_000_000_000
"""From the last random stamp to the first sound one [ns]."""
TOLERANCE = math.radians(0.5)


def rows(effort: Effort) -> Iterator[Row]:
    """Feed them all, and see what is left of them."""
    with opened_graph() as graph:
        nodes = subscribers(graph)
        sent, tilts = Numbers(_sum), Tilts()
        for publisher in _publishers(nodes):
            taped(publisher, sent)
        taped(nodes[1]._outputs._tilt, tilts.add)
        wire, random = Wiretap(*nodes), RandomMessages(effort.seed)
        count, memory = effort.tries(MESSAGES), 0.0
        for index, (topic, message) in enumerate(random.messages(10 * count)):
            wire.send(topic, message)
            if index % 5000 == 0:
                nodes[3].publish_figures()
            if not memory and 2 * wire.delivered >= count:
                memory = resident_megabytes()
            if wire.delivered >= count:
                break
        grown = resident_megabytes() - memory
        failed = callback_errors(nodes)
        calm(wire, random)
    bad = sent.counts["not finite"]
    seen = (
        f"0 of {len(nodes)} nodes ended; {failed} errors in callbacks; "
        f"{bad} of {sent.counts['published']} messages not finite; {grown:+.1f} MB"
    )
    promised = f"no end, no error, finite, below {GROWTH:g} MB in the second half"
    fine = failed == bad == 0 and grown < GROWTH
    yield Row("random messages at six nodes", wire.delivered, promised, seen, fine)
    worst = tilts.worst()
    yield Row(
        "sound readings after them",
        len(tilts.found),
        "tilt right to 0.5 deg from 2 s on",
        f"at most {math.degrees(worst):.2f} deg wrong",
        worst < TOLERANCE,
    )


def subscribers(graph: Graph) -> list[Any]:
    """Return a node of each kind that subscribes to sensors, tilts or commands."""
    made = [
        CorrectionNode(**graph.options()),
        FilterNode(**graph.options(filter="complementary", compare=["all"], predict=True)),
        ControllerNode(**graph.options(prepare_all=False)),
        EvaluatorNode(**graph.options(table=False)),
        SimulatorNode(**graph.options()),
        CheckNode(at_end=lambda: None, **graph.options()),
    ]
    return [graph.add(node) for node in made]


def _publishers(nodes: list[Any]) -> list[Any]:
    correction, tilt, controller = nodes[:3]
    return [
        correction._publisher,
        tilt._outputs._imu,
        tilt._outputs._tilt,
        controller._command,
    ]


def _sum(message: Any) -> float:
    """Return the sum of the numbers in a serialised Imu, Float64 or Float64MultiArray."""
    if len(message) > 100:
        return math.fsum(decode_imu(message)[1])
    return decode_float64(message) if len(message) < 16 else math.fsum(decode_float64s(message))


class Tilts:
    """The tilts that came, of which the last are looked at."""

    def __init__(self) -> None:
        """Start without any."""
        self.found: list[float] = []

    def add(self, message: Any) -> None:
        """Take a serialised tilt."""
        self.found.append(decode_float64(message))

    def worst(self) -> float:
        """Return the largest error of the last second [rad]."""
        last = self.found[-round(1.0 / PERIOD) :]
        return max((abs(each - LEAN) for each in last), default=math.inf)


def calm(wire: Wiretap, random: RandomMessages) -> None:
    """Send sound readings of a robot that stands leaning."""
    start = random.now + AHEAD
    for index in range(round((SETTLING + 1.0) / PERIOD)):
        stamp = start + round(index * PERIOD * 1e9)
        for topic in ("imu/data_corrected", "imu/data_raw"):
            good = Imu()
            good.header.stamp.sec, good.header.stamp.nanosec = divmod(stamp, 10**9)
            good.orientation.y, good.orientation.w = math.sin(LEAN / 2), math.cos(LEAN / 2)
            good.orientation_covariance[0] = good.orientation_covariance[4] = 1e-4
            good.angular_velocity.y = 1e-4 * (-1) ** index
            good.linear_acceleration.x = -9.80665 * math.sin(LEAN)
            good.linear_acceleration.z = 9.80665 * math.cos(LEAN)
            wire.send(topic, good)
        clock = Clock()
        clock.clock = good.header.stamp
        wire.send("/clock", clock)
