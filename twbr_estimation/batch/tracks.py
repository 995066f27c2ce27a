"""Corrected samples and estimates over a whole recording, as columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..recording import FloatArray, StampArray, Track
from ..samples import CorrectedSample


@dataclass(frozen=True, slots=True, repr=False)
class CorrectedTrack(Track):
    """Corrected samples as columns."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    columns: FloatArray
    """The fields of `CorrectedSample` as rows, (27, n)."""

    def field(self, name: str) -> FloatArray:
        """Return one field of `CorrectedSample` over time, (n,)."""
        row: FloatArray = self.columns[CorrectedSample._fields.index(name)]
        return row

    @property
    def first(self) -> CorrectedSample:
        """The first sample."""
        return CorrectedSample(*self.columns[:, 0].tolist())


@dataclass(frozen=True, slots=True)
class EstimateTrack:
    """Estimates of one filter as columns."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    columns: FloatArray
    """The fields of `TiltEstimate` as rows, (4, n)."""
    state: Any
    """The filter's state after the last sample, to go on from."""

    def __repr__(self) -> str:
        """Return the number of estimates and the range of the tilt."""
        count = self.stamps.size
        limits = np.degrees([self.tilt.min(), self.tilt.max()]) if count else (np.nan, np.nan)
        return f"<EstimateTrack: {count} estimates, {limits[0]:.1f} to {limits[1]:.1f} deg>"

    @property
    def time(self) -> FloatArray:
        """Time since the first sample [s], (n,)."""
        return np.asarray((self.stamps - self.stamps[:1]) * 1e-9, dtype=np.float64)

    @property
    def tilt(self) -> FloatArray:
        """Tilt [rad], (n,)."""
        row: FloatArray = self.columns[0]
        return row

    @property
    def rate(self) -> FloatArray:
        """Tilt rate [rad/s], (n,)."""
        row: FloatArray = self.columns[1]
        return row

    @property
    def gyro_bias(self) -> FloatArray:
        """Gyro bias [rad/s], (n,); zeros where the filter has none."""
        row: FloatArray = self.columns[2]
        return row

    @property
    def tilt_variance(self) -> FloatArray:
        """Variance of the tilt [rad^2], (n,); zeros where unknown."""
        row: FloatArray = self.columns[3]
        return row
