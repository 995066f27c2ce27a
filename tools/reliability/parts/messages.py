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

from reliability.all_nodes import subscribers, tapped, tick
from reliability.graph import (
    Numbers,
    Wiretap,
    callback_errors,
    error_lines,
    opened_graph,
    resident_megabytes,
    taped,
)
from reliability.random_messages import RandomMessages
from reliability.row import Effort, Row
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.memory import give_back
from twbr_estimation.streams.messages import decode_float64, decode_float64s, decode_imu

MESSAGES = 1_000_000
LOOKS = 200
"""Messages between two looks of timers and browsers."""
GROWTH = 10.0
"""Memory that the second half of the messages may add [MB]."""
LEAN, PERIOD, SETTLING = 0.1, 0.005, 2.0
"""Of the sound readings at the end: tilt [rad], period [s] and time left for the return [s]."""
AHEAD = 100_000_000_000
"""From the last random stamp to the first sound one [ns]."""
TOLERANCE = math.radians(0.5)


def rows(effort: Effort) -> Iterator[Row]:
    """Feed them all, by their own clock and by `/clock`, and see what is left of them."""
    for simulated_time in (False, True):
        yield from _fed(effort, simulated_time)


def _fed(effort: Effort, simulated_time: bool) -> Iterator[Row]:
    with opened_graph() as graph:
        nodes = subscribers(graph, simulated_time)
        sent, tilts = Numbers(_sum), Tilts()
        for publisher in _publishers(nodes):
            taped(publisher, sent)
        taped(of_kind(nodes, FilterNode)[0]._outputs._tilt, tilts.add)
        wire, random = tapped(nodes), RandomMessages(effort.seed + 1000 * simulated_time)
        grown = _feed(wire, random, nodes, effort.tries(MESSAGES // 2))
        failed, delivered = callback_errors(nodes) + wire.raised.total(), wire.delivered
        for what, times in [*wire.raised.items(), *error_lines(nodes)]:
            print(f"  {times} times: {what}", flush=True)
        calm(wire, random)
    bad = sent.counts["not finite"]
    clock = ", by /clock" if simulated_time else ""
    yield Row(
        f"random messages at {len(nodes)} nodes{clock}",
        delivered,
        f"no end, no error, finite, below {GROWTH:g} MB in the second half",
        f"0 of {len(nodes)} nodes ended; {failed} errors in callbacks; "
        f"{bad} of {sent.counts['published']} messages not finite; {grown:+.1f} MB",
        failed == bad == 0 and grown < GROWTH,
    )
    worst = tilts.worst()
    yield Row(
        f"sound readings after them{clock}",
        len(tilts.found),
        "tilt right to 0.5 deg from 2 s on",
        f"at most {math.degrees(worst):.2f} deg wrong",
        worst < TOLERANCE,
    )


def _feed(wire: Wiretap, random: RandomMessages, nodes: list[Any], count: int) -> float:
    """Deliver `count` messages; return by how much the second half let the memory grow [MB]."""
    memory = 0.0
    for index, (topic, message) in enumerate(random.messages(10 * count)):
        wire.send(topic, message, random.spoiled)
        if index % LOOKS == 0:
            tick(nodes, wire)
        if index % (20 * LOOKS) == 0:
            give_back()
        if not memory and 2 * wire.delivered >= count:
            give_back()
            memory = resident_megabytes()
        if wire.delivered >= count:
            break
    give_back()
    return resident_megabytes() - memory


def of_kind(nodes: list[Any], kind: type[Any]) -> list[Any]:
    """Return the nodes of a kind."""
    return [node for node in nodes if isinstance(node, kind)]


def _publishers(nodes: list[Any]) -> list[Any]:
    found = [each._publisher for each in of_kind(nodes, CorrectionNode)]
    found += [each._command for each in of_kind(nodes, ControllerNode)]
    for each in of_kind(nodes, FilterNode):
        found += [each._outputs._imu, each._outputs._tilt]
    return found


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
