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
from collections.abc import Sequence
from itertools import accumulate
from operator import mul

from ..samples import MOTORS, READINGS, RESTART_GAP, CorrectedSample, is_silent

_AT = {name: place for place, name in enumerate(CorrectedSample._fields)}
"""Place of each field in a sample."""
_AXES = tuple(
    (_AT[name], _AT[name.replace("_", "_variance_")], _AT[name.replace("_", "_saturated_")])
    for name in READINGS
)
"""Places of reading, variance and saturation of each axis."""
_MOTORS = tuple(_AT[name] for name in MOTORS)
_DT, _ANGLE, _ANGLE_VARIANCE = _AT["dt"], _AT["angle"], _AT["angle_variance"]
_RATE, _MOTOR_COUNT = _AT["gyro_y"], _AT["motor_count"]

Column = Sequence[float]
"""One field of all samples."""


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
    does not average out. No line leads through a silence: an interval with one is silent. The
    wheels are those of the last sample, the motors' voltage the mean over the interval, unknown
    where it is so for any sample.

    Args:
        samples: at least one, in order; the first one's `dt` belongs to the interval.
    """
    last = samples[-1]
    if len(samples) == 1:
        return last
    # Plain numbers at their places: arrays of five or ten elements, and names, cost more.
    columns, values = tuple(zip(*samples, strict=True)), list(last)
    dt = columns[_DT]
    weights = _end_weights(_time_left(dt))
    averaged, silent = _dot(weights, weights), any(map(is_silent, samples))
    for reading, variance, saturated in _AXES:
        values[reading] = 0.0 if silent else _dot(weights, columns[reading])
        values[saturated] = max(columns[saturated])
        low, high = min(columns[variance]), max(columns[variance])
        values[variance] = high if values[saturated] else averaged * low + (high - low)
    known, time = all(columns[_MOTOR_COUNT]), sum(dt)
    for place in _MOTORS:
        values[place] = _dot(dt, columns[place]) / time if known else 0.0
    values[_DT] = time
    values[_ANGLE], values[_ANGLE_VARIANCE] = _angle_at_end(columns, dt)
    return CorrectedSample._make(values)


def _dot(a: Column, b: Column) -> float:
    return float(sum(map(mul, a, b)))


def _time_left(dt: Column) -> list[float]:
    """Return the time from each sample to the last one [s], (n,)."""
    return [0.0, *accumulate(dt[:0:-1])][::-1]


def _end_weights(left: Column) -> list[float]:
    """Return the weights that give the end of the least-squares line, (n,), n above 1."""
    mean = sum(left) / len(left)
    offset = [each - mean for each in left]
    share, slope = 1.0 / len(left), mean / _dot(offset, offset)
    return [share - each * slope for each in offset]


def _angle_at_end(columns: Sequence[Column], dt: Column) -> tuple[float, float]:
    """Return the angle [rad] at the end of the interval, and its variance."""
    angle, rate = columns[_ANGLE], columns[_RATE]
    turns = [0.5 * dt[k] * (rate[k] + rate[k - 1]) for k in range(1, len(dt))]
    turned = [0.0, *accumulate(turns[::-1])][::-1]
    certainty = [1.0 / variance for variance in columns[_ANGLE_VARIANCE]]
    total, end = sum(certainty), angle[-1]
    off = [
        math.remainder(each + turn - end, 2.0 * math.pi)
        for each, turn in zip(angle, turned, strict=True)
    ]
    return math.remainder(end + _dot(certainty, off) / total, 2.0 * math.pi), 1.0 / total
