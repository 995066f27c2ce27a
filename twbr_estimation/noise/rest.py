"""Periods of rest of a sensor, and the drift of its bias there: Laddach 2022, Figs 7 and 8."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks.blocks import BLOCK, runs_of, window_means
from ..recording import FloatArray, ImuTrack

_BLOCKS = 10  # in a window that is at rest or not
RATE_LIMIT = 0.01
"""Largest standard deviation of the averaged rate at rest [rad/s]."""
ACCEL_LIMIT = 0.1
"""Largest standard deviation of the averaged specific force at rest [m/s^2]."""


@dataclass(frozen=True, slots=True)
class Drift:
    """Means over successive windows."""

    window: float
    """Length of a window [s]."""
    times: FloatArray
    """Middle of each window from the start [s], (w,)."""
    means: FloatArray
    """Mean of each window, (w, 3)."""

    @property
    def spread(self) -> FloatArray:
        """Largest minus smallest mean of each axis, (3,)."""
        return np.asarray(np.ptp(self.means, axis=0), dtype=np.float64)


def longest_rest(imu: ImuTrack, dt: float) -> slice:
    """Return the longest run of samples in which the sensor does not move.

    Windows of a second are judged by how much averages over `BLOCK` vary in them: slow
    turns pass as rest only where their rate is constant.

    Args:
        imu: n readings.
        dt: median sampling period [s].
    """
    block = max(1, round(BLOCK / dt))
    size = block * _BLOCKS
    count = imu.stamps.size // size
    calm = np.ones(count, dtype=bool)
    for values, limit in ((imu.gyro, RATE_LIMIT), (imu.accel, ACCEL_LIMIT)):
        means = window_means(values[: count * size], block).reshape(count, _BLOCKS, 3)
        calm &= np.all(means.std(axis=1) < limit, axis=1)
    runs = runs_of(calm)
    if runs.size == 0:
        return slice(0, 0)
    begin, end = runs[np.argmax(runs[:, 1] - runs[:, 0])].tolist()
    return slice(begin * size, end * size)


def drift(values: FloatArray, period: float, window: float) -> Drift:
    """Return the means over windows; a rest of a window at the end is left out.

    Args:
        values: equidistant readings at rest, (n, 3).
        period: sampling period [s].
        window: length of a window [s].
    """
    size = min(values.shape[0], max(1, int(window / period)))
    means = window_means(values, size)
    return Drift(size * period, (np.arange(means.shape[0]) + 0.5) * size * period, means)
