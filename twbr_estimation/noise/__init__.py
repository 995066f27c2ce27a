"""Noise of the sensors: spectra, Allan deviation, and bias over time."""

from __future__ import annotations

from .allan import AllanCurve, allan_curve
from .analysis import GYRO_UNIT, RecordingNoise, analyse, as_json
from .rest import Drift
from .spectra import AngleNoise, Spectrum, angle_noise, spectrum
from .uniform import UniformSpan, uniform_stretch

__all__ = [
    "GYRO_UNIT",
    "AllanCurve",
    "AngleNoise",
    "Drift",
    "RecordingNoise",
    "Spectrum",
    "UniformSpan",
    "allan_curve",
    "analyse",
    "angle_noise",
    "as_json",
    "spectrum",
    "uniform_stretch",
]
