"""Means over short blocks of time: what every search for rest looks at, free of the noise."""

from __future__ import annotations

import numpy as np

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


def window_means(values: FloatArray, size: int) -> FloatArray:
    """Return the means of successive whole windows of so many readings, (w, k), of (n, k)."""
    size = min(max(size, 1), values.shape[0])
    count = values.shape[0] // size
    means: FloatArray = values[: count * size].reshape(count, size, -1).mean(axis=1)
    return means
