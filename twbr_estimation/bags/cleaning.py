"""Repairs of one topic's messages, each counted; what comes out increases in time.

Messages are first put into the order in which they were recorded: by the bag's times, or, where
their own stamps rise better so (the recorder's clock was set back), as they lie in the file. Then
* stamps of zero are dropped, except a first one that the next follows within a second;
* where two senders alternate, each with a clock of its own, the messages of one are kept;
* where a clock ticks more slowly than messages come, those of one tick are spread evenly in it;
* a lone stamp more than a second off both neighbours is dropped;
* of messages equal in stamp and content the first is kept;
* where stamps jump back (a looped bag, a clock that was set) the longest stretch between such
  jumps is kept: two passes cannot share one time line. A step of more than a second is such a
  jump, a smaller one where the messages after it run through time that was covered already;
* other backward steps are messages that came late: they are sorted in;
* of equal stamps the first message is kept;
* gaps are counted, not filled.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recording import ABSURD
from .coarse_stamps import spread_in_ticks
from .decoding import Columns

JUMP = 1_000_000_000
"""Backward step that separates two passes [ns]."""
GAP_PERIODS = 5.0
"""Median sampling periods that make a gap."""

ALTERNATING = 0.1
"""Share of backward jumps among the messages from which on two senders alternate."""

REPEATED = "messages with a repeated stamp dropped"
_SHORTEST_PASS = 5  # messages; fewer are late ones

_LATEST = 1 << 62
"""Stamps beyond this [ns], in the year 2116, are damage."""

Repairs = Counter[str]
Required = slice | Sequence[int]
"""Which columns must be finite and sane."""


@dataclass(slots=True)
class Cleaner:
    """Cleans the messages of one topic and counts what it did."""

    topic: str
    repairs: Repairs

    def clean(self, columns: Columns, required: Required) -> Columns:
        """Return the repaired messages; the `required` columns are finite.

        Raises:
            RecordingError: every stamp is zero, or the same.
        """
        columns = _in_recorded_order(columns)
        finite = np.all(np.isfinite(columns.values[:, required]), axis=1)
        columns = self.keep(columns, finite, "messages with NaN or infinity dropped")
        sane = np.all(np.abs(columns.values[:, required]) < ABSURD, axis=1)
        columns = self.keep(columns, sane, f"messages with a number beyond {ABSURD:g} dropped")
        possible = np.abs(columns.stamps) < _LATEST
        columns = self.keep(columns, possible, "messages with an impossible stamp dropped")
        columns = self._one_frame(columns)
        columns = self._stamped(columns)
        columns = self._one_clock(columns)
        columns = self._one_time_each(columns)
        columns = self._one_pass(columns)
        columns = self._sorted(columns)
        self._count_gaps(columns)
        return columns

    def keep(self, columns: Columns, good: NDArray[np.bool_], why: str) -> Columns:
        """Return the good messages and count the others under `why`."""
        dropped = int(np.count_nonzero(~good))
        if not dropped:
            return columns
        self.count(why, dropped)
        return _chosen(columns, np.flatnonzero(good))

    def count(self, what: str, number: int) -> None:
        """Count a repair of this topic."""
        if number:
            self.repairs[f"{self.topic}: {what}"] += number

    def _one_frame(self, columns: Columns) -> Columns:
        frames = columns.frames
        if not frames.size or bool(np.all(frames == frames[0])):
            return columns
        usual = Counter(frames.tolist()).most_common(1)[0][0]
        return self.keep(
            columns, frames == usual, f"messages of a frame other than {usual!r} dropped"
        )

    def _stamped(self, columns: Columns) -> Columns:
        zero = columns.stamps == 0
        if columns.stamps.size > 2 and not zero.any() and not np.ptp(columns.stamps):
            raise RecordingError(
                f"{self.topic}: the header stamps of all {zero.size} messages are equal; "
                "`topics.stamps`: arrival takes the time of recording"
            )
        if not zero.any():
            return columns
        if zero.size > 1 and zero.all():
            raise RecordingError(
                f"{self.topic}: the header stamps of all {zero.size} messages are 0; "
                "`topics.stamps`: arrival takes the time of recording"
            )
        if zero[0] and not zero[1:].any() and columns.stamps[1:2].sum() <= JUMP:
            return columns
        return self.keep(columns, ~zero, "messages with stamp 0 dropped")

    def _one_clock(self, columns: Columns) -> Columns:
        """Keep the messages of one of several senders that alternate with clocks of their own."""
        falls = np.count_nonzero(np.diff(columns.stamps) < -JUMP)
        if falls < _SHORTEST_PASS or falls < ALTERNATING * columns.stamps.size:
            return columns
        ahead = columns.stamps - columns.bag_times
        # Of equally many, those whose clock is nearest to the recorder's.
        usual = min(
            Counter((ahead // JUMP).tolist()).items(), key=lambda each: (-each[1], abs(each[0]))
        )
        near = np.abs(ahead - (usual[0] * JUMP + JUMP // 2)) <= 2 * JUMP
        return self.keep(
            columns, near, "messages of another sender, with a clock of its own, dropped"
        )

    def _one_time_each(self, columns: Columns) -> Columns:
        """Spread the messages of a clock that ticks more slowly than they come."""
        before = columns.stamps
        columns, tick = spread_in_ticks(columns)
        if tick:
            what = f"messages spread evenly within a tick of their clock, {1e3 * tick:.3g} ms"
            self.count(what, int(np.count_nonzero(columns.stamps != before)))
        return columns

    def _one_pass(self, columns: Columns) -> Columns:
        columns = self.keep(columns, ~_lone(columns.stamps), "messages with a stray stamp dropped")
        if columns.stamps.size < 2 or np.diff(columns.stamps).min() >= 0:
            return columns
        columns = self.keep(columns, _first_of_equals(columns), REPEATED)
        cuts = _passes(columns.stamps)
        if not cuts.size:
            return columns
        edges = np.concatenate([[0], cuts, [columns.stamps.size]])
        longest = int(np.argmax(np.diff(edges)))
        inside = np.zeros(columns.stamps.size, dtype=bool)
        inside[edges[longest] : edges[longest + 1]] = True
        self.count("backward jumps of the stamps", int(cuts.size))
        return self.keep(columns, inside, "messages outside the longest pass dropped")

    def _sorted(self, columns: Columns) -> Columns:
        if columns.stamps.size < 2:
            return columns
        late = int(np.count_nonzero(columns.stamps < np.maximum.accumulate(columns.stamps)))
        if late:
            self.count("late messages sorted in", late)
            columns = _chosen(columns, np.argsort(columns.stamps, kind="stable"))
        fresh = np.append(True, np.diff(columns.stamps) > 0)
        return self.keep(columns, fresh, REPEATED)

    def _count_gaps(self, columns: Columns) -> None:
        if columns.stamps.size < 3:
            return
        periods = np.diff(columns.stamps)
        limit = GAP_PERIODS * float(np.median(periods))
        self.count(
            f"gaps longer than {limit * 1e-9:.3g} s left as they are",
            int(np.count_nonzero(periods > limit)),
        )


def _in_recorded_order(columns: Columns) -> Columns:
    order = np.argsort(columns.bag_times, kind="stable")
    if np.array_equal(order, np.arange(order.size)):
        return columns
    sorted_ = _chosen(columns, order)
    return columns if _falls(columns.stamps) < _falls(sorted_.stamps) else sorted_


def _falls(stamps: NDArray[np.int64]) -> int:
    return int(np.count_nonzero(np.diff(stamps) < 0))


def _lone(stamps: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which stamps are far from both neighbours, which are near each other."""
    lone = np.zeros(stamps.size, dtype=bool)
    if stamps.size < 3:
        return lone
    steps = np.abs(np.diff(stamps))
    across = np.abs(stamps[2:] - stamps[:-2])
    lone[1:-1] = (steps[:-1] > JUMP) & (steps[1:] > JUMP) & (across <= JUMP)
    return lone


def _passes(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return where passes begin after the first: the indices after jumps back in time."""
    jumps = [0, *(np.flatnonzero(np.diff(stamps) < -JUMP) + 1).tolist(), stamps.size]
    cuts = jumps[1:-1]
    for begin, end in pairwise(jumps):
        cuts += [begin + cut for cut in _set_back(stamps[begin:end])]
    return np.array(sorted(cuts), dtype=np.int64)


def _set_back(stamps: NDArray[np.int64]) -> Iterator[int]:
    """Yield where time that was covered already is run through again.

    Late messages fill the hole that they left; those of a clock that was set back do not.
    """
    newest = np.maximum.accumulate(stamps)
    falls = (np.diff(stamps) < 0) & (stamps[:-1] == newest[:-1])
    for start in (1 + np.flatnonzero(falls)).tolist():
        stop = start + int(np.searchsorted(newest[start:], newest[start - 1], "right"))
        again = stamps[start:stop]
        if again.size < _SHORTEST_PASS or np.mean(np.diff(again) > 0) < 0.9:
            continue
        earlier = stamps[np.searchsorted(newest, again.min()) : start]
        covered = np.count_nonzero((earlier >= again.min()) & (earlier <= again.max()))
        if 2 * covered >= again.size:
            yield start


def _first_of_equals(columns: Columns) -> NDArray[np.bool_]:
    """Return which messages are the first of their stamp and content."""
    rows = np.column_stack([columns.stamps, columns.values.view(np.int64)])
    first = np.zeros(columns.stamps.size, dtype=bool)
    first[np.unique(rows, axis=0, return_index=True)[1]] = True
    return first


def _chosen(columns: Columns, indices: NDArray[np.int64]) -> Columns:
    return replace(
        columns,
        stamps=columns.stamps[indices],
        bag_times=columns.bag_times[indices],
        values=columns.values[indices],
        frames=columns.frames[indices],
    )
