"""Spectra of noise and motion, and how far they overlap: Laddach 2022, Fig. 11.

The figure's scale is not given; here a spectrum is the one-sided power spectral density by
Welch's method, so that the area under it is the signal's power.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray

SEGMENTS = 8
"""Segments, half overlapping, that are averaged; more where segments would get too long."""
_SHORTEST, _LONGEST = 256, 1 << 14
MOTION_SHARE = 0.95
"""The motion's band holds this share of its power."""
STILL_POWER = 1e-3
"""A reference with less power [deg^2] does not move: encoders round by more."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """A one-sided power spectral density."""

    frequency: FloatArray
    """[Hz], (k,), from 0 to half the sampling rate."""
    density: FloatArray
    """[unit^2/Hz], (k,)."""

    def area(self, highest: float = math.inf) -> float:
        """Return the power below a frequency [Hz], in the signal's unit squared."""
        inside = self.frequency <= highest
        return float(self.density[inside].sum() * (self.frequency[1] - self.frequency[0]))


@dataclass(frozen=True, slots=True)
class AngleNoise:
    """The error of an angle that the accelerometer gives, beside the motion itself."""

    spectrum: Spectrum
    """Of the error [deg^2/Hz]."""
    area_deg2: float
    """Power of the error."""
    snr_db: float | None
    """Power of the motion over power of the error; None where nothing moves."""
    in_band_deg2: float | None
    """Power of the error within the motion's band; None where nothing moves."""
    coherent_share: float | None
    """Share of the error's power that follows the motion linearly; None where nothing moves."""


def _segment(size: int) -> int:
    """Return the samples of a segment: a power of two."""
    wanted = 1 << max(0, (size // (SEGMENTS // 2)).bit_length() - 1)
    return min(size, max(_SHORTEST, min(wanted, _LONGEST)))


def spectrum(values: FloatArray, period: float) -> Spectrum:
    """Return the spectrum of a signal without its mean.

    Args:
        values: equidistant samples, (n,).
        period: sampling period [s].
    """
    size = _segment(values.size)
    # The signal's own mean goes, the segments' means stay: slow drift is noise, too.
    waves = _waves(values - values.mean(), size)
    density = np.mean(np.square(np.abs(waves)), axis=0) * period / np.sum(np.square(_hann(size)))
    density[1 : (size + 1) // 2] *= 2.0  # negative frequencies; those at the ends have none
    frequency = np.asarray(np.fft.rfftfreq(size, period), dtype=np.float64)
    return Spectrum(frequency, density)


def _hann(size: int) -> FloatArray:
    return np.square(np.sin(np.pi * np.arange(size) / size))


def _waves(values: FloatArray, size: int) -> NDArray[np.complex128]:
    """Return the Fourier transforms of half-overlapping segments under a Hann window."""
    segments = np.lib.stride_tricks.sliding_window_view(values, size)[:: size - size // 2]
    return np.asarray(np.fft.rfft(segments * _hann(size), axis=1), dtype=np.complex128)


def band_of(motion: Spectrum) -> float:
    """Return the frequency [Hz] below which the motion has `MOTION_SHARE` of its power.

    It is 0 where nothing moves.
    """
    if motion.area() <= STILL_POWER:
        return 0.0
    power = np.cumsum(motion.density)
    return float(motion.frequency[np.searchsorted(power, MOTION_SHARE * power[-1])])


def angle_noise(error: FloatArray, tilt: FloatArray, period: float) -> AngleNoise:
    """Return the noise of an angle.

    Args:
        error: angle minus reference [deg], (n,).
        tilt: the reference [deg], (n,).
        period: sampling period [s].
    """
    noise, motion = spectrum(error, period), spectrum(tilt, period)
    power, area = motion.area(), noise.area()
    moves = power > STILL_POWER and area > 0.0
    return AngleNoise(
        noise,
        area,
        10.0 * math.log10(power / area) if moves else None,
        noise.area(band_of(motion)) if moves else None,
        _coherent_share(error, tilt, period) if moves else None,
    )


def _coherent_share(error: FloatArray, tilt: FloatArray, period: float) -> float:
    """Return the share of the error's power that a linear filter could make of the tilt."""
    size = _segment(error.size)
    moved, missed = (_waves(values - values.mean(), size) for values in (tilt, error))
    shared = np.abs(np.mean(np.conj(moved) * missed, axis=0)) ** 2
    powers = (np.mean(np.square(np.abs(waves)), axis=0) for waves in (moved, missed))
    coherent = shared / math.prod(powers)
    averaged = max(2, 2 * (error.size // size) - 1)
    # Unrelated signals have a coherence of 1 / averages; only what is above it counts.
    above = (coherent - 1.0 / averaged) / (1.0 - 1.0 / averaged)
    density = spectrum(error, period).density
    return max(0.0, float((above * density).sum() / density.sum()))
