"""Fewer points for a plot, without losing a peak."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray

LARGEST_STEP = 5.0
"""A line is broken where times are further apart than this many usual steps."""


def peaks(values: FloatArray, points: int) -> NDArray[np.int64]:
    """Return indices of about `points` values that draw the same line as all of them.

    The signal is cut into equal buckets; of each the smallest and the largest value stay, in
    their order, and the first and last value of all.

    Args:
        values: the signal, (n,).
        points: how many to keep, at least 4.
    """
    count = values.size
    if count <= points:
        return np.arange(count)
    size = -(-count // (points // 2))
    whole = count // size * size
    buckets = np.asarray(values[:whole]).reshape(-1, size)
    starts = np.arange(buckets.shape[0]) * size
    kept = np.zeros(count, dtype=bool)
    kept[starts + buckets.argmin(axis=1)] = True
    kept[starts + buckets.argmax(axis=1)] = True
    kept[whole:] = kept[0] = kept[-1] = True
    return np.flatnonzero(kept)


def thinned(times: FloatArray, values: FloatArray, points: int) -> tuple[FloatArray, FloatArray]:
    """Return a line of about `points` points, broken by NaN where there is a gap.

    Args:
        times: increasing, (n,).
        values: (n,).
        points: how many to keep, at least 4.
    """
    kept = peaks(values, points)
    steps = np.diff(times)
    gaps = np.flatnonzero(steps > LARGEST_STEP * np.median(steps)) if steps.size else steps
    if not gaps.size:
        return times[kept], values[kept]
    where = np.unique(np.searchsorted(kept, gaps, side="right"))
    where = where[where < kept.size]
    return np.insert(times[kept], where, times[kept[where]]), np.insert(values[kept], where, np.nan)
