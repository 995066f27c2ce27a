"""Overlapping Allan deviation and what is usually read off it (IEEE Std 952).

White noise of a rate falls with tau^-1/2 and gives the random walk of its integral; where
the curve is flat it gives the bias instability; a random walk of the rate rises with
tau^+1/2. A reading is None where the curve does not have that slope.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import ConfigurationError
from ..recording import FloatArray

FEWEST_CLUSTERS = 5
"""Averaging times end where fewer independent averages than this are left."""
_TIMES_PER_OCTAVE = 4
_SLOPE_TOLERANCE = 0.15
_FEWEST_POINTS = 3  # of a curve that make a slope
_FLAT = math.sqrt(2.0 * math.log(2.0) / math.pi)  # 0.664, deviation over instability
MARKED_TIMES = (1.0, 10.0, 100.0)
"""Averaging times whose deviation is reported [s]."""


@dataclass(frozen=True, slots=True)
class AllanCurve:
    """The Allan deviation of one axis; `unit` is that of its rate."""

    axis: str
    unit: str
    time: FloatArray
    """Averaging times [s], (k,)."""
    deviation: FloatArray
    """Allan deviation [unit], (k,)."""
    random_walk: float | None
    """Of the integral, from white noise [unit s^1/2], that is unit/sqrt(Hz)."""
    bias_instability: float | None
    """Deviation at the curve's lowest point over 0.664 [unit]."""
    rate_random_walk: float | None
    """[unit/s^1/2]."""

    def at(self, time: float) -> float | None:
        """Return the deviation at an averaging time [s], or None outside the curve."""
        if not self.time[0] <= time <= self.time[-1]:
            return None
        logarithm = np.interp(math.log(time), np.log(self.time), np.log(self.deviation))
        return float(math.exp(logarithm))

    def marked(self) -> Mapping[str, float | None]:
        """Return the deviation at 1, 10 and 100 s."""
        return {f"{time:g} s": self.at(time) for time in MARKED_TIMES}


def allan_curve(values: FloatArray, period: float, axis: str, unit: str) -> AllanCurve:
    """Return the Allan deviation of one axis at rest.

    Args:
        values: equidistant readings, (n,).
        period: sampling period [s].
        axis: the axis's name.
        unit: unit of the readings.

    Raises:
        ConfigurationError: the package `allantools` is missing.
    """
    try:
        from allantools import oadev
    except ImportError as error:
        raise ConfigurationError(
            "the Allan deviation needs allantools: pip install 'twbr_estimation[noise]'"
        ) from error
    longest = values.size // FEWEST_CLUSTERS
    octaves = math.log2(longest)
    clusters = np.unique(
        np.round(np.logspace(0.0, octaves, int(octaves * _TIMES_PER_OCTAVE) + 1, base=2.0))
    )
    time, deviation, _, _ = oadev(
        values, rate=1.0 / period, data_type="freq", taus=clusters * period
    )
    white, flat, rising = _readings(time, deviation)
    return AllanCurve(axis, unit, time, deviation, white, flat, rising)


def _readings(
    time: FloatArray, deviation: FloatArray
) -> tuple[float | None, float | None, float | None]:
    """Return random walk, bias instability and rate random walk."""
    if not np.all(deviation > 0.0):
        return None, None, None  # a sensor with a constant reading
    slope = np.gradient(np.log(deviation), np.log(time))
    lowest = int(np.argmin(deviation))
    white = _on_slope(slope[: lowest + 1], -0.5, deviation * np.sqrt(time))
    rising = _on_slope(slope[lowest:], 0.5, (deviation * np.sqrt(3.0 / time))[lowest:])
    turned = 0 < lowest < time.size - 1
    return white, float(deviation[lowest]) / _FLAT if turned else None, rising


def _on_slope(slope: FloatArray, wanted: float, reading: FloatArray) -> float | None:
    """Return the median reading where the curve has the wanted slope."""
    there = np.flatnonzero(np.abs(slope - wanted) < _SLOPE_TOLERANCE)
    return float(np.median(reading[there])) if there.size >= _FEWEST_POINTS else None
