"""Combination of fast samples for a slow loop.

A sensor that is read from its FIFO at 1 kHz gives a loop of 10 or 20 ms ten or twenty samples
an interval. Taking the last one lets vibration and shocks between two of them alias into the
estimate. Here a straight line is fitted to the rates and the specific forces of an interval by
least squares, and its end is the combined sample. It belongs to the present instant, as every
filter expects; the trapezoidal rule over two such ends gives the mean of the fast samples where the
lines meet. A plain mean would be half an interval late.

The angle of Laddach 2022 (13) is carried to the end of the interval by the gyro, from each
sample separately, and averaged with the inverse variances as weights.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate
from operator import mul

from ..samples import MOTORS, READINGS, RESTART_GAP, CorrectedSample

_VARIANCES = tuple(name.replace("_", "_variance_") for name in READINGS)
_SATURATED = tuple(name.replace("_", "_saturated_") for name in READINGS)


class Oversampler:
    """Combines a stream of corrected samples into one of longer intervals."""

    def __init__(self, period: float) -> None:
        """`period`: length of an interval [s]; at 0 every sample passes as it is."""
        self._period = period
        self._pending: list[CorrectedSample] = []
        self._elapsed = 0.0

    def reset(self) -> None:
        """Forget the samples of an interval that has not ended."""
        self._pending.clear()
        self._elapsed = 0.0

    def add(self, sample: CorrectedSample) -> CorrectedSample | None:
        """Take a sample; return the combined one where an interval ends with it.

        The number of samples is the one that comes nearest to the period. A first sample, or
        one after a gap above `RESTART_GAP`, passes at once: it starts a filter.
        """
        if not 0.0 < sample.dt <= RESTART_GAP:
            self.reset()
            return sample
        self._pending.append(sample)
        self._elapsed += sample.dt
        if self._elapsed < self._period - 0.5 * sample.dt:
            return None
        result = combined(self._pending)
        self.reset()
        return result


def combined(samples: Sequence[CorrectedSample]) -> CorrectedSample:
    """Return the samples of one interval as one sample at its end.

    White noise averages out. An axis that was saturated in any sample stays so, and its variance
    does not average out. The wheels are those of the last sample, the motors' voltage the mean
    over the interval, unknown where it is so for any sample.

    Args:
        samples: at least one, in order; the first one's `dt` belongs to the interval.
    """
    last = samples[-1]
    if len(samples) == 1:
        return last
    # Plain numbers: arrays of five or ten elements cost more than they save.
    rows = dict(zip(CorrectedSample._fields, zip(*samples, strict=True), strict=True))
    dt = rows["dt"]
    weights = _end_weights(_time_left(dt))
    averaged = _dot(weights, weights)
    fields = {name: _dot(weights, rows[name]) for name in READINGS}
    for variance, saturated in zip(_VARIANCES, _SATURATED, strict=True):
        fields[saturated] = max(rows[saturated])
        low, high = min(rows[variance]), max(rows[variance])
        fields[variance] = high if fields[saturated] else averaged * low + (high - low)
    known, time = all(rows["motor_count"]), sum(dt)
    fields |= {name: _dot(dt, rows[name]) / time if known else 0.0 for name in MOTORS}
    angle, variance_of_angle = _angle_at_end(rows, dt)
    return last._replace(dt=time, angle=angle, angle_variance=variance_of_angle, **fields)


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return float(sum(map(mul, a, b)))


def _time_left(dt: Sequence[float]) -> list[float]:
    """Return the time from each sample to the last one [s], (n,)."""
    return [0.0, *accumulate(dt[:0:-1])][::-1]


def _end_weights(left: Sequence[float]) -> list[float]:
    """Return the weights that give the end of the least-squares line, (n,), n above 1."""
    mean = sum(left) / len(left)
    offset = [each - mean for each in left]
    share, slope = 1.0 / len(left), mean / _dot(offset, offset)
    return [share - each * slope for each in offset]


def _angle_at_end(rows: Mapping[str, Sequence[float]], dt: Sequence[float]) -> tuple[float, float]:
    """Return the angle [rad] at the end of the interval, and its variance."""
    angle, rate = rows["angle"], rows["gyro_y"]
    turns = [0.5 * dt[k] * (rate[k] + rate[k - 1]) for k in range(1, len(dt))]
    turned = [0.0, *accumulate(turns[::-1])][::-1]
    certainty = [1.0 / variance for variance in rows["angle_variance"]]
    total, end = sum(certainty), angle[-1]
    off = [
        math.remainder(each + turn - end, 2.0 * math.pi)
        for each, turn in zip(angle, turned, strict=True)
    ]
    return math.remainder(end + _dot(certainty, off) / total, 2.0 * math.pi), 1.0 / total
