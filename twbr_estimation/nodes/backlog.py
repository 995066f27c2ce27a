"""A node that cannot keep up drops messages, so that its timers and services get their turn.

The executor serves events in the order in which they came, and each message that arrives is one,
even where the middleware's queue has dropped the message meanwhile. Where messages come faster
than they are handled, the events before that of a timer become more without a limit: reports,
answers of services and parameters would be late by ten seconds and more. The messages that can
still be taken are at most as many as the queues hold: where a timer is due and more than those
have been handled before it, the rest is dropped, quickly, until that timer has its turn. Timers
that were cancelled or destroyed do not count.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.qos import HistoryPolicy

PATIENCE = 0.5
"""How late a timer may be before messages are dropped [s]."""
EXCESS = 1.25
"""Messages that are handled before a timer that is due, in what all queues can hold."""


class Backlog:
    """Compares when the quickest timer of a node is due with when it is called."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """`now`: a steady clock [s]."""
        self._now = now
        self._timers: list[tuple[float, Any]] = []
        self._period = self._due = math.inf
        self._depths: dict[str, float] = {}
        self._limit = 0.0
        self._handled = 0
        self._dropping = False
        self.dropped = 0
        """Messages that were dropped."""
        self.meanwhile: Callable[[float], None] = _nothing
        """Called with the time [s] before a message while the timer is late."""

    def add_timer(self, period: float, timer: Any) -> None:
        """Take a timer of this period [s] on a steady clock, an rclpy `Timer`, into account."""
        self._timers.append((period, timer))
        self._period = min(self._period, period)

    def begin(self) -> None:
        """Begin to watch: from now on an executor serves the node."""
        self._due = self._now() + self._period

    def add_queue(self, topic: str, quality: Any) -> None:
        """Take the queue of a subscription into account.

        Args:
            topic: Its name.
            quality: Of service, as `rclpy.qos.QoSProfile`.
        """
        bounded = quality.history == HistoryPolicy.KEEP_LAST and quality.depth > 0
        self._depths[topic] = quality.depth if bounded else math.inf
        self._limit = EXCESS * sum(self._depths.values())

    def ticked(self, period: float) -> None:
        """Note that a timer of this period [s] is being called."""
        if period == self._period and self._due < math.inf:
            self._due, self._handled, self._dropping = self._now() + period, 0, False

    def drops(self) -> bool:
        """Return whether the message that has come is to be dropped; count it."""
        now = self._now()
        late = now > self._due + PATIENCE and not self._turned_to_another(now)
        if late:
            self.meanwhile(now)
        if not self._dropping:
            self._handled += now > self._due
            self._dropping = late and self._handled > self._limit
        self.dropped += self._dropping
        return self._dropping

    def _turned_to_another(self, now: float) -> bool:
        """Watch the quickest timer that there is; return whether it is another one."""
        self._timers = [each for each in self._timers if _runs(each[1])]
        period = min((each[0] for each in self._timers), default=math.inf)
        if period == self._period:
            return False
        self._period, self._due, self._handled, self._dropping = period, now + period, 0, False
        return True


def _runs(timer: Any) -> bool:
    """Return whether a timer is neither cancelled nor destroyed."""
    try:
        return not timer.is_canceled()
    except InvalidHandle:
        return False


def _nothing(now: float) -> None:
    """Do nothing."""
