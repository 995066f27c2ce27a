"""When the motors must be cut because no tilt was taken: a deadline that a thread watches.

Free of clocks: the caller passes the time of a steady one, in seconds.
"""

from __future__ import annotations

from collections.abc import Callable

REPEAT = 0.05
"""Time between two cuts while nothing changes [s]."""


class Deadline:
    """The last tilt that was taken, and whether the motors run since."""

    def __init__(self, limit: Callable[[], float]) -> None:
        """`limit`: returns the longest time without a tilt [s] while the motors run."""
        self._limit = limit
        self._fed = 0.0
        self.running = False
        """Whether the latest command drives a motor."""
        self.missed = 0
        """Number of times the deadline passed."""
        self._missing = False

    def feed(self, now: float) -> None:
        """Note that a tilt was taken."""
        self._fed, self._missing = now, False

    def check(self, now: float) -> tuple[bool, float]:
        """Return whether to cut the motors now, and when to look again [s from now]."""
        limit = self._limit()
        left = self._fed + limit - now
        if left > 0.0:
            return False, left if self.running else min(left, 0.5 * limit)
        if not (self.running or self._missing):
            return False, min(0.5 * limit, REPEAT)
        self.missed += not self._missing
        self._missing, self.running = True, False
        return True, REPEAT
