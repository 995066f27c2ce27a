"""Means over short blocks of time, free of the noise, and what else every search for rest needs.

A sensor at rest is searched for in five ways, which differ in what they may assume:

| where | judges | at rest are |
|---|---|---|
| `filters/inertial/stillness.py` | each sample, by those before it | readings near the run's mean |
| `checks/rest.py` | 0.5 s of any sensor, however noisy, with its wheels | two seconds in a row |
| `noise/rest.py` | 1 s of readings as they are | the longest run, for an Allan deviation |
| `calibration/stillness.py` | the whole time that was asked for | blocks near their median |
| `calibration/held.py` | 0.25 s of a sensor turned by hand | a second without a change of pose |

`calibration/held_poses.py` goes by the reference encoder instead. One rule for all would change
figures: of `bags/verification` the noise analysis uses a second at rest, of which the checks, which
want two in a row, say nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray

BLOCK = 0.1
"""Readings are averaged over this time [s] before they are searched for motion."""


class Blocks:
    """Readings at any stamps, sorted into blocks of `BLOCK`; empty blocks are left out."""

    def __init__(self, times: FloatArray) -> None:
        """`times`: of n readings, rising or falling [s], (n,)."""
        self.numbers, self.of_reading = np.unique(np.floor(times / BLOCK), return_inverse=True)
        """Number of each block from time 0, (b,); and which block a reading is in, (n,)."""
        self._counts = np.bincount(self.of_reading)
        self.centres = self.means(times)
        """Mean time of each block [s], (b,)."""

    def means(self, values: FloatArray) -> FloatArray:
        """Return the mean of each block, (b,) of values (n,) and (b, k) of values (n, k)."""
        if values.ndim == 1:
            return np.asarray(np.bincount(self.of_reading, values) / self._counts)
        return np.stack([self.means(column) for column in values.T], axis=1)

    def away(self, values: FloatArray, usual: FloatArray) -> FloatArray:
        """Return how far each block's mean of values (n, k) is from `usual`, (k,): (b,)."""
        return np.asarray(np.linalg.norm(self.means(values) - usual, axis=1))


def white_deviation(values: FloatArray) -> FloatArray:
    """Return the standard deviation of one reading without drift, (k,), from values (n, k).

    Half the mean square of the differences of neighbours.
    """
    deviation: FloatArray = np.sqrt(0.5 * np.mean(np.square(np.diff(values, axis=0)), axis=0))
    return deviation


def runs_of(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return where each run of true entries begins, and where it has ended, (r, 2)."""
    padded = np.concatenate([[False], mask, [False]])
    return np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)


def window_means(values: FloatArray, size: int) -> FloatArray:
    """Return the means of successive whole windows of so many readings, (w, k), of (n, k)."""
    size = min(max(size, 1), values.shape[0])
    count = values.shape[0] // size
    means: FloatArray = values[: count * size].reshape(count, size, -1).mean(axis=1)
    return means
