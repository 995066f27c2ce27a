"""Treatment of a live sample whose stamp or values are out of order.

| what arrives | outcome |
|---|---|
| stamp zero or negative | skipped, counted as `zero_stamp` |
| the stamp of the sample before | skipped, counted as `repeated_stamp` |
| up to `RESTART_GAP` before the last | one such sample is late: skipped, `late_stamp` |
| more than that before the last, or a second late one in order | a looped recording or a clock that was set back: the stream starts afresh, `restart` |
| a step ahead like the one back before it, within `SET_BACK_FOR` | the clock was put right again: `restart` |
| more than `RESTART_GAP` after the last | taken; its `dt` makes correction and filters start afresh, `gap` |
| NaN or infinity | skipped, counted as `not_finite` |

Saturated readings are no case for this file: the correction flags them.
"""  # noqa: E501

from __future__ import annotations

from collections import Counter
from enum import Enum

from ..samples import RESTART_GAP

SET_BACK_FOR = 60.0
"""Time after a step back [s] in which a step ahead of that size is no gap in the samples."""
_GAP = round(RESTART_GAP * 1e9)
_PERIODS = 6
"""Periods of the samples that a step back must have before one ahead is looked at."""


class Verdict(Enum):
    """Treatment of a sample."""

    TAKE = "take"
    SKIP = "skip"
    RESTART = "restart"
    """Take it as the first of a new stream."""


class StampGuard:
    """Judges the stamps of one stream, in the order in which its samples arrive."""

    def __init__(self) -> None:
        """Start without a past."""
        self.counts: Counter[str] = Counter()
        """Number of times each outcome other than `TAKE` in good order occurred."""
        self._last: int | None = None
        self._late: int | None = None
        self._longest = _GAP
        """Largest step ahead that needs no second look [ns]."""
        self._set_back_until = 0

    def check(self, stamp: int) -> Verdict:
        """Return what to do with a sample of this stamp [ns]."""
        last = self._last
        if last is not None and last < stamp <= last + self._longest:
            self._last, self._late = stamp, None
            return Verdict.TAKE
        return self._judge(stamp, last)

    def skip(self, reason: str) -> Verdict:
        """Count a sample that is skipped for another reason than its stamp."""
        self.counts[reason] += 1
        return Verdict.SKIP

    def _judge(self, stamp: int, last: int | None) -> Verdict:
        if stamp <= 0:
            return self.skip("zero_stamp")
        if last is None or stamp > last:
            return self._ahead(stamp, last)
        if stamp == last:
            return self.skip("repeated_stamp")
        back_to_back = self._late is not None and stamp > self._late
        if last - stamp > _GAP or back_to_back:
            if self._late is not None and last - stamp > _PERIODS * abs(stamp - self._late):
                self._longest = min((last - stamp) // 2, _GAP)
                self._set_back_until = stamp + round(SET_BACK_FOR * 1e9)
            return self._restart(stamp)
        self._late = stamp
        return self.skip("late_stamp")

    def _ahead(self, stamp: int, last: int | None) -> Verdict:
        """Take a stamp that is later than expected, unless the clock was set back before."""
        set_right = self._longest < _GAP and stamp <= self._set_back_until
        self._longest = _GAP
        if last is not None and set_right:
            return self._restart(stamp)
        if last is not None and stamp > last + _GAP:
            self.counts["gap"] += 1
        self._last, self._late = stamp, None
        return Verdict.TAKE

    def _restart(self, stamp: int) -> Verdict:
        self.counts["restart"] += 1
        self._last, self._late = stamp, None
        return Verdict.RESTART


class StampAge:
    """Age of samples when they arrive, by the clock of this computer."""

    def __init__(self) -> None:
        """Start without a sample."""
        self.age = 0.0
        """Age of the latest sample [s]; negative for a stamp ahead."""
        self.known = False
        """Whether its stamp is of the same clock."""

    def note(self, stamp: int, now: int) -> float:
        """Take a stamp [ns] at the time `now` [ns]; return its age [s], 0 of another clock."""
        self.age = (now - stamp) * 1e-9
        self.known = now > 0 and abs(self.age) <= RESTART_GAP
        return self.age if self.known else 0.0
