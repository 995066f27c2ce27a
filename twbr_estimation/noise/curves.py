"""What a picture of the noise shows, as plain data that other processes can send."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..recording import FloatArray
from .analysis import GYRO_UNIT, MotionSpectra, RecordingNoise, Rest
from .spectra import Spectrum

Curve = tuple[list[float], list[float]]
"""Abscissae and ordinates."""
Curves = dict[str, dict[str, Curve]]
"""By panel, then by label: `angle` with a reference, `gyro`, `allan` and `bias` at rest."""
ShownCurves = Mapping[str, Mapping[str, Sequence[Sequence[float]]]]
"""The same after a way through JSON."""


def curves_of(noise: RecordingNoise) -> Curves:
    """Return all curves of a recording."""
    found: Curves = {}
    if noise.motion is not None:
        found["angle"] = _angle(noise.motion)
    if noise.rest is not None:
        found["gyro"] = {
            f"gyro {axis}": _density(entry) for axis, entry in noise.rest.gyro_spectra.items()
        }
        found["allan"] = {
            curve.axis: _curve(curve.time, curve.deviation)
            for curve in noise.rest.allan
            if curve.unit == GYRO_UNIT
        }
        found["bias"] = _bias(noise.rest)
    return found


def _angle(motion: MotionSpectra) -> dict[str, Curve]:
    """Return power densities over frequency [deg^2/Hz, Hz]."""
    found = {
        "raw angle error": _density(motion.raw.spectrum),
        "corrected angle error": _density(motion.corrected.spectrum),
    }
    return {**found, "tilt": _density(motion.tilt)} if motion.band_hz > 0.0 else found


def _bias(rest: Rest) -> dict[str, Curve]:
    """Return the bias minus its mean over time [deg/s, s]."""
    drift = rest.gyro_drift
    moved = drift.means - np.mean(drift.means, axis=0)
    return {f"gyro {axis}": _curve(drift.times, moved[:, i]) for i, axis in enumerate("xyz")}


def _density(entry: Spectrum) -> Curve:
    return _curve(entry.frequency[1:], entry.density[1:])


def _curve(x: FloatArray, y: FloatArray) -> Curve:
    return x.tolist(), y.tolist()
