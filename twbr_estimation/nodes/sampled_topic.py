"""A topic that is looked at some times a second, however fast it is published."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from ..errors import MessageError

RATE_WINDOW = 1.0
"""Time over which a rate is counted [s]."""
TURN = 3.0
"""Time for which a topic is listened to in its turn, and between two turns [s]."""


class SampledTopic:
    """Takes serialised messages when asked, without an executor.

    The middleware keeps the last `depth` messages; older ones are dropped there at no cost to
    Python. The publisher's sequence numbers still give the rate of what was published.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        kind: Any,
        depth: int,
        handle: Callable[[bytes], None],
        quality: QoSProfile | None = None,
    ) -> None:
        """Prepare; `begin` subscribes.

        Args:
            node: A node that is in no executor.
            name: Full name of the topic.
            kind: Class of its messages.
            depth: How many messages are kept between two calls of `take`.
            handle: Gets each serialised message; what it cannot read is counted.
            quality: Of service; best effort by default.
        """
        self.name = name
        self.unreadable = 0
        self.longest = 0.0
        """Longest time without a message since the first one [s]."""
        if quality is None:
            quality = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node, self._kind, self._depth, self._handle = node, kind, depth, handle
        self._quality = quality
        self._subscription: Any = None
        self._received = -math.inf
        self._sequence = 0
        self._window = (0.0, 0)
        self._rate = self._age = 0.0

    @property
    def listening(self) -> bool:
        """Whether the topic is subscribed to."""
        return self._subscription is not None

    def begin(self) -> None:
        """Subscribe; the figures go on from those before a pause."""
        if self._subscription is None:
            now = time.monotonic()
            self._window = (now, 0)
            self._received = now if math.isfinite(self._received) else -math.inf
            self._subscription = self._node.create_subscription(
                self._kind, self.name, _ignore, self._quality, raw=True
            )

    def end(self) -> None:
        """Leave the topic; rate and age stay what they are now."""
        if self._subscription is not None:
            self._rate, self._age = self.rate(), self.age()
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def take(self) -> None:
        """Handle what is there, the oldest first."""
        if self._subscription is None:
            return
        handle = self._subscription.handle
        with handle:
            for _ in range(self._depth):
                taken = handle.take_message(self._kind, True)
                if taken is None:
                    return
                self._count(taken[1].get("publication_sequence_number"))
                self.accept(taken[0])

    def accept(self, data: bytes) -> None:
        """Handle one serialised message; one that cannot be read is counted."""
        try:
            self._handle(data)
        except (MessageError, ArithmeticError, ValueError):
            self.unreadable += 1

    def _count(self, sequence: int | None) -> None:
        now = time.monotonic()
        if math.isfinite(self._received):
            self.longest = max(self.longest, now - self._received)
        self._received = now
        self._sequence = sequence if sequence else self._sequence + 1
        begin, first = self._window
        if not first:
            self._window = (now, self._sequence)
        elif now - begin >= RATE_WINDOW:
            self._rate = max(self._sequence - first, 0) / (now - begin)
            self._window = (now, self._sequence)

    def rate(self) -> float:
        """Return the messages published per second [1/s]."""
        if self._subscription is None:
            return self._rate
        return self._rate if self.age() < 2.0 * RATE_WINDOW else 0.0

    def age(self) -> float:
        """Return the time since a message was received [s]; infinite before the first."""
        return self._age if self._subscription is None else time.monotonic() - self._received


class Turns:
    """Listens to topics in turns: each gets figures from time to time, at few messages."""

    def __init__(self, topics: Sequence[SampledTopic]) -> None:
        """Begin with the first one."""
        self._topics = topics
        self._at = -1
        self._due = -math.inf

    def go_on(self, now: float, wanted: Collection[str]) -> None:
        """Listen to those that are wanted all the time, and to the one whose turn it is.

        Args:
            now: Time on a steady clock [s].
            wanted: Names of topics.
        """
        if now >= self._due:
            self._at = (self._at + 1) % (2 * len(self._topics))  # a pause after each turn
            self._due = now + TURN
        for index, topic in enumerate(self._topics):
            wants = topic.name in wanted or self._at == 2 * index
            if wants and not topic.listening:
                topic.begin()
            elif not wants and topic.listening:
                topic.end()


def _ignore(_: bytes) -> None:
    """Never called: no executor serves the node."""
