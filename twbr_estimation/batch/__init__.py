"""Correction and filters over whole recordings, by the functions of the live path."""

from __future__ import annotations

from .running import correct, oversampled, run_filter, run_filters
from .tracks import CorrectedTrack, EstimateTrack

__all__ = [
    "CorrectedTrack",
    "EstimateTrack",
    "correct",
    "oversampled",
    "run_filter",
    "run_filters",
]
