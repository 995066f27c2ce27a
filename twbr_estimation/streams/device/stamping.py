"""Which clock stamps the messages of a topic: their sender's, ours at arrival, or both related."""

from __future__ import annotations

from collections import Counter

from ...samples import RESTART_GAP, Stamps
from .clock import DeviceClock

CALENDAR = 1_000_000_000_000_000_000
"""A stamp before this one [ns], in the year 2001, is no calendar time."""
_AHEAD = 1_000_000_000
"""Stamps are this far ahead [ns] only by another clock."""
_GAP = round(RESTART_GAP * 1e9)


class Stamping:
    """The stamps of one topic."""

    def __init__(self, stamps: Stamps, topic: str) -> None:
        """Begin; `topic` is for messages."""
        self._stamps, self._topic = stamps, topic
        self._clock = DeviceClock()
        self._header = self._stamp = 0
        self._zeros = 0

    @property
    def restarts(self) -> int:
        """How often the device's clock was related again."""
        return self._clock.restarts

    def stamp(self, header: int, now: int) -> int:
        """Return the stamp [ns] that counts.

        Args:
            header: Stamp of the message [ns].
            now: Time of our clock [ns].
        """
        self._zeros += header == 0
        if self._stamps is Stamps.ARRIVAL:
            return now
        if self._stamps is Stamps.HEADER or header <= 0:
            self._header = header
            return header
        step = header - self._header
        if self._header > 0 and -_GAP < step <= 0:  # repeated or late: it stays so
            return self._stamp + step
        self._header, self._stamp = header, self._clock.stamp(header, now)
        return self._stamp

    @property
    def problem(self) -> str:
        """Why messages are not used; nothing where all is well."""
        if self._stamps is Stamps.ARRIVAL or not self._zeros:
            return ""
        return (
            f"{self._topic}: {self._zeros} messages without a stamp (0) are not used; stamps: "
            "arrival takes the time at which they come"
        )

    def remark(self, now: int) -> dict[str, str]:
        """Return, by a name, that stamps are not of the clock that shows `now` [ns]."""
        if self._stamps is not Stamps.HEADER or self._header <= 0 or now < CALENDAR:
            return {}
        if self._header - now > _AHEAD:
            ahead = (self._header - now) * 1e-9
            text = f"{ahead:.1f} s ahead of this computer's clock; stamps: device relates them"
        elif self._header < CALENDAR:
            text = (
                f"{self._header * 1e-9:.3f} s is no time of this computer but counts from a start "
                "of the sender; stamps: device relates it"
            )
        else:
            return {}
        return {f"stamps of {self._topic}": text}

    def counts(self) -> Counter[str]:
        """Return how often the device's clock began again."""
        return Counter({"clock_restarts": self.restarts} if self.restarts else {})
