"""Stamps of a clock that ticks more slowly than samples come: several messages have one stamp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .decoding import Columns

OFTEN = 0.2
"""Share of messages with the stamp of the one before from which on a clock may be coarse."""
DIFFERING = 0.2
"""Share of those whose readings differ; messages that were sent twice are the same."""
ON_TICKS = 0.9
"""Share of the steps between stamps that must be whole ticks."""
NEAR = 0.05
"""Distance from a whole tick that still is one, in ticks."""
ALTERNATING = 1.5
"""Readings of two senders differ this many times more from each other than from their own last."""


def spread_in_ticks(columns: Columns) -> tuple[Columns, float]:
    """Return messages with one stamp spread evenly over the tick, and the tick [s].

    Args:
        columns: in the order in which they were recorded.

    Returns:
        The same columns and 0 where the clock is not coarse.
    """
    stamps = columns.stamps
    repeated = np.append(False, np.diff(stamps) == 0)
    if repeated.size < 3 or repeated.mean() < OFTEN or not _differing(columns.values, repeated):
        return columns, 0.0
    steps = np.diff(stamps[~repeated])
    tick = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    if tick == 0.0 or np.mean(np.abs(steps / tick - np.rint(steps / tick)) < NEAR) < ON_TICKS:
        return columns, 0.0
    begins = np.flatnonzero(~repeated)
    sizes = np.diff(np.append(begins, stamps.size))
    place = np.arange(stamps.size) - np.repeat(begins, sizes)
    room = np.append(steps, tick)
    room = np.repeat(np.where(room > 0, np.minimum(room, tick), tick), sizes)
    inside = (room * place / np.repeat(sizes, sizes)).astype(np.int64)
    return replace(columns, stamps=stamps + inside), 1e-9 * tick


def _differing(values: NDArray[np.float64], repeated: NDArray[np.bool_]) -> bool:
    """Return whether messages with one stamp are readings of one sender at different times."""
    after = np.flatnonzero(repeated)
    known = np.where(np.isfinite(values), values, 0.0)
    if np.mean(np.any(known[after] != known[after - 1], axis=1)) < DIFFERING:
        return False
    after = after[after >= 2]
    other = np.abs(known[after] - known[after - 1]).sum(axis=0)
    own = np.abs(known[after] - known[after - 2]).sum(axis=0)
    return not bool(np.any(other > ALTERNATING * own))
