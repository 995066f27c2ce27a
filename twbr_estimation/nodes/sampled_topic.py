"""A topic that is looked at some times a second, however fast it is published."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from ..errors import MessageError

RATE_WINDOW = 1.0
"""Time over which a rate is counted [s]."""


class SampledTopic:
    """Takes serialised messages when asked, without an executor.

    The middleware keeps the last `depth` messages; older ones are dropped there at no cost to
    Python. The publisher's sequence numbers still give the rate of what was published.
    """

    def __init__(
        self, node: Node, name: str, kind: Any, depth: int, handle: Callable[[bytes], None]
    ) -> None:
        """Subscribe.

        Args:
            node: A node that is in no executor.
            name: Full name of the topic.
            kind: Class of its messages.
            depth: How many messages are kept between two calls of `take`.
            handle: Gets each serialised message; a `MessageError` of it is counted.
        """
        self.name = name
        self.unreadable = 0
        quality = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node, self._kind, self._depth, self._handle = node, kind, depth, handle
        self._subscription = node.create_subscription(kind, name, _ignore, quality, raw=True)
        self._received = -float("inf")
        self._sequence = 0
        self._window = (time.monotonic(), 0)
        self._rate = 0.0

    def take(self) -> None:
        """Handle what is there, the oldest first."""
        handle = self._subscription.handle
        with handle:
            for _ in range(self._depth):
                taken = handle.take_message(self._kind, True)
                if taken is None:
                    return
                self._count(taken[1].get("publication_sequence_number"))
                try:
                    self._handle(taken[0])
                except MessageError:
                    self.unreadable += 1

    def _count(self, sequence: int | None) -> None:
        self._received = now = time.monotonic()
        self._sequence = sequence if sequence else self._sequence + 1
        begin, first = self._window
        if now - begin >= RATE_WINDOW:
            self._rate = max(self._sequence - first, 0) / (now - begin) if first else 0.0
            self._window = (now, self._sequence)

    def rate(self) -> float:
        """Return the messages published per second [1/s]."""
        return self._rate if self.age() < 2.0 * RATE_WINDOW else 0.0

    def age(self) -> float:
        """Return the time since a message was received [s]; infinite before the first."""
        return time.monotonic() - self._received

    def destroy(self) -> None:
        """Leave the topic."""
        self._node.destroy_subscription(self._subscription)


def _ignore(_: bytes) -> None:
    """Never called: no executor serves the node."""
