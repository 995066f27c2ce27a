"""When the next message of a recording is due: by the clock, or by what the graph can take."""

from __future__ import annotations

import threading
from collections import defaultdict, deque
from collections.abc import Iterable


class Pace:
    """Maps the time of a recording to the time of a steady clock, at any speed."""

    def __init__(self, rate: float, paused: bool = False) -> None:
        """Start at `rate` times the recorded speed; 0 means without waiting."""
        self._rate = rate
        self._paused = paused
        self._recorded, self._now = 0, 0.0

    @property
    def paused(self) -> bool:
        """Whether time stands still."""
        return self._paused

    @property
    def rate(self) -> float:
        """Speed relative to the recording; 0 without waiting."""
        return self._rate

    def start_at(self, recorded: int, now: float) -> None:
        """Let the recorded time `recorded` [ns] be the time `now` [s]."""
        self._recorded, self._now = recorded, now

    def recorded_at(self, now: float) -> int:
        """Return the recorded time [ns] that is reached at `now` [s]."""
        if self._paused:
            return self._recorded
        return self._recorded + round((now - self._now) * self._rate * 1e9)

    def set_rate(self, rate: float, now: float) -> None:
        """Go on at another speed from `now` [s]."""
        self.start_at(self.recorded_at(now), now)
        self._rate = rate

    def pause(self, now: float) -> None:
        """Stop time at `now` [s]."""
        self.start_at(self.recorded_at(now), now)
        self._paused = True

    def resume(self, now: float) -> None:
        """Let time go on from where it stopped."""
        if self._paused:
            self._now, self._paused = now, False

    def delay(self, recorded: int, now: float) -> float:
        """Return how long to wait from `now` for `recorded` [ns], in seconds; not above 0 if due.

        While paused it is infinite.
        """
        if self._paused:
            return float("inf")
        if self._rate == 0.0:
            return 0.0
        return self._now + (recorded - self._recorded) * 1e-9 / self._rate - now


class FlowWindow:
    """Limits how many messages of a topic are under way to consumers that report how far they are.

    A consumer reports stamps; a message is through when every consumer has reached its stamp.
    Safe for one thread that sends and others that report.
    """

    def __init__(self, size: int, consumers: Iterable[str]) -> None:
        """Allow `size` messages of each topic under way to the consumers of these names."""
        self._size = size
        self._reached = dict.fromkeys(consumers, -1)
        self._under_way: defaultdict[str, deque[int]] = defaultdict(deque)
        self._changed = threading.Condition()

    def restart(self) -> None:
        """Forget what is under way and how far the consumers are."""
        with self._changed:
            self._under_way.clear()
            self._reached = dict.fromkeys(self._reached, -1)
            self._changed.notify_all()

    def send(self, topic: str, stamp: int, limit: float) -> bool:
        """Wait for room for one more message of a topic, and count it as under way.

        Args:
            topic: its topic.
            stamp: its stamp [ns].
            limit: give up when no consumer has reported for this long [s].

        Returns:
            False where it gave up; what was under way is forgotten then.
        """
        with self._changed:
            room = self._wait(topic, self._size, limit)
            self._under_way[topic].append(stamp)
        return room

    def drain(self, limit: float) -> bool:
        """Wait until nothing is under way; returns and gives up as `send` does."""
        with self._changed:
            return all(self._wait(topic, 1, limit) for topic in list(self._under_way))

    def reached(self, consumer: str, stamp: int) -> None:
        """Note that a consumer has dealt with everything up to `stamp` [ns]."""
        with self._changed:
            self._reached[consumer] = stamp
            through = min(self._reached.values())
            for stamps in self._under_way.values():
                while stamps and stamps[0] <= through:
                    stamps.popleft()
            self._changed.notify_all()

    def _wait(self, topic: str, below: int, limit: float) -> bool:
        while len(self._under_way[topic]) >= below:
            if not self._changed.wait(limit):
                self._under_way.clear()
                return False
        return True
