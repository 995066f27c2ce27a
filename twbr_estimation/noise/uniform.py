"""Equidistant samples from real stamps, as spectra and Allan deviations need them.

Samples are neither filled in nor interpolated, because both would smooth the noise that is
to be measured. Instead the longest stretch without a gap is taken, and its samples count as
equidistant at their mean period; the jitter that this ignores is measured and reported.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import RecordingError
from ..recording import StampArray

LARGEST_STEP = 5.0
"""Steps between samples above this many median periods are gaps."""


@dataclass(frozen=True, slots=True)
class UniformSpan:
    """Samples that count as equidistant."""

    first: int
    """Index of the first sample."""
    last: int
    """Index after the last sample."""
    period: float
    """Mean sampling period [s]."""
    jitter: float
    """Standard deviation of the sampling period [s]."""
    left_out: int
    """Samples before or after it."""

    @property
    def samples(self) -> slice:
        """The samples as a slice."""
        return slice(self.first, self.last)

    @property
    def duration(self) -> float:
        """Time it covers [s]."""
        return (self.last - self.first) * self.period


def uniform_stretch(stamps: StampArray, what: str, minimum: float) -> UniformSpan:
    """Return the longest stretch of a track without a gap.

    Args:
        stamps: [ns], (n,), increasing.
        what: the track, for messages.
        minimum: shortest stretch that serves [s].

    Raises:
        RecordingError: there is no stretch that long.
    """
    if stamps.size < 2:
        raise RecordingError(f"{what}: {stamps.size} samples are too few for a spectrum")
    steps = np.diff(stamps)
    cuts = np.flatnonzero(steps > LARGEST_STEP * float(np.median(steps))) + 1
    edges = np.concatenate([[0], cuts, [stamps.size]])
    longest = int(np.argmax(np.diff(edges)))
    first, last = int(edges[longest]), int(edges[longest + 1])
    periods = np.diff(stamps[first:last]) * 1e-9
    period = float(periods.mean()) if periods.size else 0.0
    if (last - first) * period < minimum:
        raise RecordingError(
            f"{what}: the longest stretch without a gap lasts {(last - first) * period:.3g} s; "
            f"at least {minimum:g} s are needed"
        )
    left_out = int(stamps.size) - (last - first)
    return UniformSpan(first, last, period, float(periods.std()), left_out)
