"""Whether a simulated clock runs: under `use_sim_time` nothing happens without `/clock`."""

from __future__ import annotations

import time

from rclpy.node import Node

SILENCE = 2.0
"""A simulated clock that stands still for longer [s] is reported."""


class ClockWatch:
    """Checks a node's clock from time to time."""

    def __init__(self, node: Node) -> None:
        """`node`: whose clock it is."""
        self._node = node
        self._reading = 0
        self._moved = time.monotonic()

    def age(self) -> float:
        """Return for how long the simulated clock has stood still [s]; 0 where time is real."""
        now, clock = time.monotonic(), self._node.get_clock()
        if not clock.ros_time_is_active:
            self._reading, self._moved = 0, now
            return 0.0
        reading = clock.now().nanoseconds
        if reading != self._reading:
            self._reading, self._moved = reading, now
        return now - self._moved

    def silence(self) -> str:
        """Return a message if `/clock` has no publisher; else nothing."""
        age = self.age()
        if not self._node.get_clock().ros_time_is_active:
            return ""
        if self._reading == 0:
            return "use_sim_time is true and nothing has come on /clock"
        if age < SILENCE:
            return ""
        return f"use_sim_time is true and /clock has stood still for {age:.0f} s"
