"""Times of a log that come from a counter which starts again at 0."""

from __future__ import annotations

import numpy as np

from ..bags.cleaning import Repairs
from ..recording import FloatArray

WRAPS = (2.0**16, 2.0**32, 2.0**24, 2.0**31)
"""Sizes of counters that start again at 0."""
_PERIODS = 100.0
"""A counter that started again goes on within this many median steps."""


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
