"""Readings of the wheels that are repeated between two new ones.

An encoder that is read less often than it is sent gives the same angle several times and then
the step of all that time at once: taken as it comes, its wheel stands and jumps. The repeats are
left out, so that it is the slower encoder that it is. Those of a coarse encoder differ: its steps
are one count, or readings change one after another as soon as the wheel is faster.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..samples import NANOSECONDS_PER_SECOND

if TYPE_CHECKING:
    from numpy.typing import NDArray

LEAST = 1e-9
"""Less than this is no step but rounding [rad]."""
COUNTS = 4.0
"""A step above so many of the smallest steps seen, after a repeat, is that of a longer time."""
LONGEST = 0.1
"""Repeats for longer than this are a wheel that stood [s]."""
KNOWN, MOST, CONTRARY = 3, 8, 2
"""So many such steps show that readings are repeated, at most so many are remembered, and a step
without a repeat before it counts as so many against."""
STANDS = 1.5
"""A reading repeated for so many usual times counts: the wheel stands."""
MEMORY = 0.25
"""Share of the latest time in the usual one."""
_LONGEST = round(LONGEST * NANOSECONDS_PER_SECOND)


class Repeats(NamedTuple):
    """What is known of an encoder's repeated readings."""

    angle: float
    """Mean angle of the wheels in the latest reading [rad]."""
    difference: float
    """Right minus left [rad]."""
    latest: int
    """Its stamp [ns]."""
    counted: int
    """Stamp of the latest reading that counts [ns]."""
    changed: int
    """Stamp of the latest new one, which differed from the one before [ns]."""
    smallest: float
    """Smallest step so far [rad]."""
    shown: int
    """How clearly readings are repeated, 0 to `MOST`."""
    usual: float
    """Usual time from one new reading to the next [ns]."""

    @property
    def repeated(self) -> float:
        """For how long a reading is repeated [s]; 0 where none is."""
        return self.usual / NANOSECONDS_PER_SECOND if self.shown >= KNOWN else 0.0


def begin(stamp: int, angle: float, difference: float) -> Repeats:
    """Return what a first reading leaves: stamp [ns], mean angle and difference [rad]."""
    return Repeats(angle, difference, stamp, stamp, stamp, math.inf, 0, 0.0)


def follow(before: Repeats, stamp: int, angle: float, difference: float) -> Repeats:
    """Return what holds after a reading, which counts where `counted` is its stamp.

    Args:
        before: what the readings before left.
        stamp: of the reading [ns], later than theirs.
        angle: mean angle of the wheels [rad].
        difference: right minus left [rad].
    """
    _, _, latest, counted, changed, smallest, shown, usual = before
    step = max(abs(angle - before.angle), abs(difference - before.difference))
    if step < LEAST:
        if shown < KNOWN or stamp - counted >= STANDS * usual:
            counted = stamp
        return Repeats(angle, difference, stamp, counted, changed, smallest, shown, usual)
    smallest = min(smallest, step)
    if latest == changed:
        shown = max(shown - CONTRARY, 0)
    elif step > COUNTS * smallest and stamp - changed < _LONGEST:
        usual += (MEMORY if shown > 0 else 1.0) * (stamp - changed - usual)
        shown = min(shown + 1, MOST)
    return Repeats(angle, difference, stamp, stamp, stamp, smallest, shown, usual)


def counting(
    stamps: NDArray[np.int64], angle: NDArray[np.float64], difference: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which of n readings count, (n,): stamps [ns], mean angles, differences [rad]."""
    if not _shown(stamps, angle, difference):
        return np.ones(stamps.size, dtype=bool)
    readings = zip(stamps.tolist(), angle.tolist(), difference.tolist(), strict=True)
    now, counts = begin(*next(readings)), [True]
    for reading in readings:
        now = follow(now, *reading)
        counts.append(now.counted == now.latest)
    return np.array(counts)


def _shown(
    stamps: NDArray[np.int64], angle: NDArray[np.float64], difference: NDArray[np.float64]
) -> bool:
    """Return whether `KNOWN` steps in a row show at all that readings are repeated."""
    step = np.maximum(np.abs(np.diff(angle)), np.abs(np.diff(difference)))
    new = np.flatnonzero(step >= LEAST)
    if new.size <= KNOWN:
        return False
    step, since = step[new], np.diff(new, prepend=-1)
    time = np.diff(stamps[new + 1], prepend=stamps[:1])
    larger = step > COUNTS * np.minimum.accumulate(step)
    longer = (since > 1) & larger & (time < _LONGEST)
    events = longer[longer | (since == 1)].tolist()
    return any(all(events[i : i + KNOWN]) for i in range(len(events) - KNOWN + 1))
