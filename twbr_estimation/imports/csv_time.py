"""Times of a log that come from a counter which starts again at 0."""

from __future__ import annotations

import numpy as np

from ..bags.cleaning import Repairs
from ..recording import FloatArray

WRAPS = (2.0**16, 2.0**32, 2.0**24, 2.0**31)
"""Sizes of counters that start again at 0."""
_PERIODS = 100.0
"""A counter that started again goes on within this many median steps."""

_LEAST_STEPS = 4
"""Fewer steps of a clock give no rate of the rows."""
_LONGEST_PERIOD = 1.5
"""Rows of one time are taken as evenly spread up to the next for up to this many usual periods."""


def unwrapped(counter: FloatArray, modulus: float) -> FloatArray:
    """Return a counter that started again at `modulus` as one that went on; 0 means never.

    A step back by more than half the modulus counts as a new start.
    """
    if not modulus:
        return counter
    turns = np.cumsum(np.diff(counter, prepend=counter[0]) < -modulus / 2.0)
    return counter + modulus * turns


def counter_size(counter: FloatArray, repairs: Repairs) -> float:
    """Return the size of the counter that the times come from; 0 where none started again.

    Every large step back must be that of the same size, less about a usual step.
    """
    steps = np.diff(counter)
    back = steps[steps < 0.0]
    usual = float(np.median(np.abs(steps))) if steps.size else 0.0
    for size in WRAPS:
        if back.size and counter.max() < size and np.all(np.abs(back + size) < _PERIODS * usual):
            repairs[f"counter of the time starts again at {size:.0f}, gone on"] += back.size
            return size
    return 0.0


def spread(times: FloatArray, repairs: Repairs) -> FloatArray:
    """Return times whose clock steps rarely with the rows of each step evenly up to the next.

    A clock steps rarely where most rows have the time of the row before, as with times in whole
    seconds, or of an arrival in bursts. Other times are returned as they are.
    """
    first = np.flatnonzero(np.diff(times, prepend=np.nan) != 0.0)
    if first.size < _LEAST_STEPS or 2 * first.size > times.size:
        return times
    rows = np.diff(np.append(first, times.size))
    period = np.append(np.diff(times[first]) / rows[:-1], 0.0)
    usual = float(np.median(period[1:-1]))
    period[(period <= 0.0) | (period > _LONGEST_PERIOD * usual)] = usual
    period[0] = period[-1] = usual
    begin = times[first]
    begin[0] = begin[1] - rows[0] * usual  # the log may begin between two steps
    within = np.arange(times.size) - np.repeat(first, rows)
    repairs["rows of one time spread evenly up to the next time"] += times.size - first.size
    result: FloatArray = np.repeat(begin, rows) + within * np.repeat(period, rows)
    return result
