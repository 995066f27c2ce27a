"""Notice that an input has fallen silent, by the wall's clock."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer

PERIOD = 0.05
"""Time between two looks at the input [s]."""


def wall_timer(node: Node, period: float, tick: Callable[[], None]) -> Timer:
    """Return a timer of this period [s] that goes on where ROS time stands still."""
    return node.create_timer(period, tick, clock=Clock(clock_type=ClockType.STEADY_TIME))


class Watchdog:
    """Time since the last sample, checked regularly whatever ROS time does."""

    def __init__(self, node: Node, timeout: float, tick: Callable[[], None]) -> None:
        """Start looking.

        Args:
            node: The node that owns the timer.
            timeout: Age of the last sample [s] from which on the input is stale.
            tick: Called at every look.
        """
        self.timeout = timeout
        self._fed: float | None = None
        self._timer = wall_timer(node, PERIOD, tick)

    def feed(self) -> None:
        """Note that a sample came."""
        self._fed = time.monotonic()

    @property
    def started(self) -> bool:
        """Whether any sample ever came."""
        return self._fed is not None

    @property
    def age(self) -> float:
        """Time since the last sample [s]; 0 before the first."""
        return 0.0 if self._fed is None else time.monotonic() - self._fed

    @property
    def fresh(self) -> bool:
        """Whether the last sample is younger than the timeout."""
        return self._fed is not None and self.age < self.timeout
