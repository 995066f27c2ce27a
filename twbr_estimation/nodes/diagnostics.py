"""Publish the state of a node on `/diagnostics` at a slow, steady rate."""

import time
from collections.abc import Callable, Mapping
from enum import Enum
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..streams.callback_errors import described
from ..streams.messages import DiagnosticEncoder
from .clock_watch import ClockWatch
from .guard import Guard
from .qos import diagnostics

LATE = 1.25
"""Periods after which a report is published even if its timer does not get its turn."""


class Level(Enum):
    """Level of a status."""

    OK = DiagnosticStatus.OK
    WARN = DiagnosticStatus.WARN
    ERROR = DiagnosticStatus.ERROR
    STALE = DiagnosticStatus.STALE


class Report(NamedTuple):
    """Status of one part of a node."""

    level: Level
    message: str
    """One short sentence."""
    values: Mapping[str, object]
    """Counters and figures by name, units in the name."""


class Diagnostics:
    """Asks for a report once a period, and logs each change of level."""

    def __init__(
        self, node: Node, report: Callable[[], Report], hardware_id: str = "", period: float = 1.0
    ) -> None:
        """Start publishing.

        Args:
            node: The node that reports; its name is the status' name.
            report: Returns the present state; called once a period.
            hardware_id: Which device it is about.
            period: Time between two messages [s].
        """
        self._node, self._period = node, period
        self._published, self._dropped = time.monotonic(), 0
        self._report = report
        self._encoder = DiagnosticEncoder(node.get_fully_qualified_name().lstrip("/"), hardware_id)
        self._level = Level.OK
        self._clock = ClockWatch(node)
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", diagnostics())
        # Wall time: a node under a simulated clock that stands still must be able to report it.
        wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(period, self.update, clock=wall)
        if isinstance(node, Guard):
            node.backlog.meanwhile = self._update_where_late

    def update(self) -> None:
        """Publish now."""
        report = self._with_troubles(self._reported())
        stamp = self._node.get_clock().now().nanoseconds
        values = {key: _shown(value) for key, value in report.values.items()}
        data = self._encoder.encode(stamp, report.level.value, report.message, values)
        self._publisher.publish(data)
        self._published = time.monotonic()
        self._log_change(report)

    def _update_where_late(self, now: float) -> None:
        """Publish between two messages of a node whose timers do not get their turn."""
        if now - self._published > LATE * self._period:
            self.update()

    def _reported(self) -> Report:
        try:
            return self._report()
        except Exception as error:  # a report must come in any case
            if isinstance(self._node, Guard):
                self._node.note_error("report", error)
            return Report(Level.ERROR, f"the report failed: {described(error)}", {})

    def _with_troubles(self, report: Report) -> Report:
        """Add what any node may suffer from: errors in callbacks, a clock that stands still."""
        level, sentences, values = report.level, [report.message], dict(report.values)
        if isinstance(self._node, Guard) and self._node.callback_errors.counts:
            values["callback_errors"] = self._node.callback_errors.counts.total()
            if recent := self._node.callback_errors.recent(time.monotonic()):
                sentences.append(f"an error in a callback: {recent}")
                level = Level.WARN if level is Level.OK else level
        if self._node_drops(values):
            sentences.append("too slow: messages come faster than this node handles them")
            level = Level.WARN if level is Level.OK else level
        if silence := self._clock.silence():
            sentences.insert(0, silence)
            level = Level.WARN if level is Level.OK else level
        return Report(level, "; ".join(sentences), values)

    def _node_drops(self, values: dict[str, object]) -> bool:
        """Return whether messages were dropped since the last report; add their count."""
        if not isinstance(self._node, Guard) or not self._node.backlog.dropped:
            return False
        before, self._dropped = self._dropped, self._node.backlog.dropped
        values["messages_dropped"] = self._dropped
        return self._dropped > before

    def _log_change(self, report: Report) -> None:
        if report.level is self._level:
            return
        self._level = report.level
        if isinstance(self._node, Guard) and report.message == self._node.failure:
            return  # logged when it happened
        logger = self._node.get_logger()
        # One call for each level: rclpy ties a severity to the line that logs.
        if report.level in (Level.OK, Level.STALE):  # stale is a node that is not active
            logger.info(report.message)
        elif report.level is Level.WARN:
            logger.warning(report.message)
        elif report.level is Level.ERROR:
            logger.error(report.message)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
