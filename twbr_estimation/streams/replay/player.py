"""Plays a recording from a thread: timing, pauses, loops and flow control; no ROS in it."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Protocol

from ...errors import ConfigurationError
from ...samples import LAST_STAMP, NANOSECONDS_PER_SECOND
from .pacing import FlowWindow, Pace

CLOCK_PERIOD = 10_000_000
"""Recorded time between two clock messages [ns]."""
STALL_LIMIT = 2.0
"""At rate 0: messages under way are given up after this time without a report [s]."""
DRAIN_LIMIT = 0.5
"""The same at the end of a pass, where consumers may keep the last samples [s]."""
CLOCK_GAP = 10_000_000_000
"""A header stamp further from the recorded time [ns] is of another clock than the recorder's."""
SHORTEST_PASS = 0.1
"""A pass of a loop takes at least this time [s], or one message would be sent without end."""
_STAMP = 4
"""Offset of the stamp in a serialised message that begins with a header."""


class MessageSource(Protocol):
    """Messages in the order of their recorded times."""

    def __len__(self) -> int:
        """Return the number of messages."""
        ...

    def time(self, index: int) -> int:
        """Return when a message was recorded [ns]."""
        ...

    def first_at(self, time: int) -> int:
        """Return the index of the first message recorded at `time` [ns] or later."""
        ...

    def message(self, index: int) -> tuple[str, bytes]:
        """Return topic and serialised content."""
        ...


class Sink(Protocol):
    """Destination of messages."""

    def publish(self, topic: str, content: bytes) -> None:
        """Send one message."""
        ...

    def publish_clock(self, now: int) -> None:
        """Send the recorded time [ns]."""
        ...

    def flush(self) -> None:
        """Wait until subscribers have taken what was sent."""
        ...

    def now(self) -> int:
        """Return the present time [ns]."""
        ...


@dataclass(frozen=True, slots=True)
class PlayedPart:
    """Which part of a recording is played, and how its stamps are treated."""

    start: float = 0.0
    """Time at the beginning that is left out [s]."""
    duration: float = 0.0
    """Time that is played from there [s]; 0 is all."""
    restamp: bool = False
    """Shift stamps so that each pass begins now, whatever clock they are of."""


class HeaderClocks:
    """By how much the header stamps of each topic are shifted in one pass.

    Stamps of the recorder's clock move with the recorded times. Those of a device or a simulation
    move as far as lets the first of them be its recorded time; topics of one such clock together.
    """

    def __init__(self, shift: int, restamp: bool) -> None:
        """`shift`: of the recorded times [ns]; `restamp`: whether other clocks move, too."""
        self._shift, self._restamp = shift, restamp
        self._shifts: dict[str, int] = {}
        self._clocks: list[tuple[int, int]] = []  # offset from the recorder's clock, shift
        self.gaps: dict[str, float] = {}
        """Offset of the topics' clocks that are not the recorder's [s]."""

    def shift(self, topic: str, stamp: int, recorded: int) -> int:
        """Return the shift [ns] of a topic, decided at its first message."""
        found = self._shifts.get(topic)
        if found is None:
            found = self._shifts[topic] = self._decided(topic, stamp - recorded)
        return found

    def _decided(self, topic: str, offset: int) -> int:
        if abs(offset) <= CLOCK_GAP:
            return self._shift
        self.gaps[topic] = offset * 1e-9
        if not self._restamp:
            return self._shift
        for known, shift in self._clocks:
            if abs(offset - known) <= CLOCK_GAP:
                return shift
        self._clocks.append((offset, self._shift - offset))
        return self._shift - offset


class Player:
    """Plays a source into a sink; `play` blocks, everything else may be called meanwhile."""

    def __init__(
        self,
        source: MessageSource,
        sink: Sink,
        pace: Pace,
        stretch: PlayedPart | None = None,
    ) -> None:
        """Prepare to play.

        Args:
            source: what to play.
            sink: where to.
            pace: the speed.
            stretch: which part; all by default.

        Raises:
            ConfigurationError: the part begins behind the last message, or holds none.
        """
        self._source, self._sink, self._pace = source, sink, pace
        self._window: FlowWindow | None = None
        self._stretch = stretch or PlayedPart()
        self._require_messages()
        self._woken = threading.Condition()
        self._stopped = False
        self.loop = False
        """Whether to begin again at the end."""
        self.position = 0
        """Recorded time that was reached [ns]."""
        self.other_clocks: dict[str, float] = {}
        """By how much topics are stamped by another clock than the recorder's [s]."""
        self.played = self.passes = self.stalls = 0
        """Messages sent, passes ended, and times that consumers stopped reporting."""

    @property
    def paused(self) -> bool:
        """Whether it waits for `resume`."""
        return self._pace.paused

    def play(
        self, stamped: Collection[str], window: FlowWindow | None = None, flush_every: int = 100
    ) -> None:
        """Play until the end, or until `stop`.

        Args:
            stamped: topics whose messages begin with a header.
            window: at rate 0, how many messages may be under way; None asks the sink to
                flush from time to time instead.
            flush_every: messages between two flushes.
        """
        self._window = window
        while not self._stopped:
            begin = time.monotonic()
            self._play_pass(stamped, flush_every)
            self.passes += 1
            if not self.loop:
                break
            self._rest(begin + SHORTEST_PASS)
        if not (self._stopped or self._limited()):
            self._sink.flush()  # takes seconds: at the very end only

    def pause(self) -> None:
        """Stop time."""
        self._change(lambda now: self._pace.pause(now))

    def resume(self) -> None:
        """Let time go on."""
        self._change(lambda now: self._pace.resume(now))

    def set_rate(self, rate: float) -> None:
        """Go on at another speed."""
        self._change(lambda now: self._pace.set_rate(rate, now))

    def report(self, consumer: str, stamp: int) -> None:
        """Note that a consumer of the window has dealt with all up to `stamp` [ns]."""
        if self._window is not None:
            self._window.reached(consumer, stamp)

    def stop(self) -> None:
        """End `play` soon."""
        with self._woken:
            self._stopped = True
            self._woken.notify_all()
        if self._window is not None:
            self._window.restart()

    def _change(self, change: Callable[[float], None]) -> None:
        with self._woken:
            change(time.monotonic())
            self._woken.notify_all()

    def _play_pass(self, stamped: Collection[str], flush_every: int) -> None:
        first, last = self._limits()
        begin = self._source.time(first)
        shift = self._sink.now() - begin if self._stretch.restamp else 0
        next_clock = begin
        clocks = HeaderClocks(shift, self._stretch.restamp)
        self.other_clocks = clocks.gaps
        with self._woken:
            self._pace.start_at(begin, time.monotonic())
        if self._window is not None:
            self._window.restart()
        for index in range(first, last):
            recorded = self._source.time(index)
            if not self._wait_until(recorded):
                return
            self.position = recorded
            if recorded >= next_clock:
                self._sink.publish_clock(recorded + shift)
                next_clock = recorded + CLOCK_PERIOD
            topic, content = self._source.message(index)
            self._send(topic, content, recorded, clocks if topic in stamped else None)
            if self._window is None and self._pace.rate == 0.0 and self.played % flush_every == 0:
                self._sink.flush()
        if self._window is not None and self._limited():
            self._window.drain(DRAIN_LIMIT)

    def _require_messages(self) -> None:
        """Refuse a part of the recording in which there is nothing to play."""
        length = (self._source.time(len(self._source) - 1) - self._source.time(0)) * 1e-9
        if self._stretch.start > length:
            raise ConfigurationError(
                f"start: {self._stretch.start:g} s is behind the end of the recording, which is "
                f"{length:.6g} s long"
            )
        first, last = self._limits()
        if first >= last:
            raise ConfigurationError(
                f"duration: there is no message in the {self._stretch.duration:g} s after "
                f"{self._stretch.start:g} s; play longer"
            )

    def _rest(self, until: float) -> None:
        """Wait until a time of the steady clock [s], or until `stop`."""
        with self._woken:
            while not self._stopped and (left := until - time.monotonic()) > 0.0:
                self._woken.wait(left)

    def _limited(self) -> bool:
        """Whether a window sets the speed."""
        return self._window is not None and self._pace.rate == 0.0

    def _limits(self) -> tuple[int, int]:
        begin = self._source.time(0) + round(self._stretch.start * NANOSECONDS_PER_SECOND)
        first = min(self._source.first_at(begin), len(self._source) - 1)
        if self._stretch.duration == 0.0:
            return first, len(self._source)
        return first, self._source.first_at(
            begin + round(self._stretch.duration * NANOSECONDS_PER_SECOND)
        )

    def _wait_until(self, recorded: int) -> bool:
        """Wait until a message is due; False where `stop` came first."""
        with self._woken:
            while not self._stopped:
                delay = self._pace.delay(recorded, time.monotonic())
                if delay <= 0.0:
                    return True
                self._woken.wait(None if delay == float("inf") else delay)
        return False

    def _send(self, topic: str, content: bytes, recorded: int, clocks: HeaderClocks | None) -> None:
        if clocks is not None and len(content) >= _STAMP + 8:
            shift = clocks.shift(topic, stamp_of(content), recorded)
            stamp, content = shifted(content, shift)
            if self._window is not None and self._limited():
                self.stalls += not self._window.send(topic, stamp, STALL_LIMIT)
        self._sink.publish(topic, content)
        self.played += 1


def shifted(content: bytes, shift: int) -> tuple[int, bytes]:
    """Return a serialised message's header stamp moved by `shift` [ns], and the message with it.

    A stamp that would leave the range of a header stays at its end.
    """
    stamp = min(max(stamp_of(content) + shift, 0), LAST_STAMP)
    if shift == 0:
        return stamp, content
    moved = struct.pack(_form(content), *divmod(stamp, NANOSECONDS_PER_SECOND))
    return stamp, content[:_STAMP] + moved + content[_STAMP + len(moved) :]


def stamp_of(content: bytes) -> int:
    """Return the stamp [ns] of a serialised message that begins with a header."""
    seconds, nanoseconds = struct.unpack_from(_form(content), content, _STAMP)
    return int(seconds) * NANOSECONDS_PER_SECOND + int(nanoseconds)


def _form(content: bytes) -> str:
    return "<iI" if content[1] == 1 else ">iI"
