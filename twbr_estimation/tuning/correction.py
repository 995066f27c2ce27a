"""Tune the correction's low-pass filters (16) and (19): Laddach 2022, Table 1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ..batch import correct
from ..filters.base import Parameter
from ..parameters.bounds import Bounds
from ..recording import FloatArray
from ..robot import CorrectionSettings
from .merit import Merit, merit_of
from .objective import Objective, TuningSet
from .search import Progress, SearchResult, no_progress, search

LARGEST_TIME_CONSTANT = 1.0
"""Upper bound of the low-pass time constants in a search [s]."""
_DEFAULT_TIME_CONSTANT = 0.02


@dataclass(frozen=True, slots=True)
class TunedCorrection:
    """Result of tuning the low-pass filters."""

    settings: CorrectionSettings
    mse_before_deg2: float
    """MSE of the angle with no correction of motion, as in Table 1 [deg^2]."""
    mse_after_deg2: float
    """MSE of the corrected angle [deg^2]."""
    evaluations: int
    interrupted: bool = False


def tune_correction(
    sets: Sequence[TuningSet], seed: int = 0, progress: Progress = no_progress
) -> TunedCorrection:
    """Find the time constants that make the corrected angle best; Ctrl-C keeps the best so far.

    A time constant whose term is switched off, or of wheels that no recording has, is kept.

    Args:
        sets: training recordings; the settings of the first are the start.
        seed: of the global search.
        progress: called with the best MSE so far [deg^2].
    """
    base = sets[0].setup.correction
    start = {name: max(getattr(base, name), 0.0) for name in _searched(base, sets)}
    bounds = Bounds(0.0, LARGEST_TIME_CONSTANT, "s", "low-pass time constant")
    parameters = {
        name: Parameter(name, value or _DEFAULT_TIME_CONSTANT, bounds)
        for name, value in start.items()
    }

    @cache
    def judged_before(settings: CorrectionSettings) -> Merit:
        return _merit(sets, settings)

    def judge(values: Mapping[str, float]) -> Merit:
        return judged_before(_changed(base, values))

    latest = SearchResult(start, judge(start).figure, 1)

    def watch(best: float, values: Mapping[str, float]) -> None:
        nonlocal latest
        latest = SearchResult(dict(values), best, latest.evaluations + 1)
        progress(best, values)

    interrupted = False
    try:
        latest = search(parameters, judge, [start], seed, watch)
    except KeyboardInterrupt:
        interrupted = True
    dt = float(np.mean([each.dt for each in sets]))
    return TunedCorrection(
        replace(_changed(base, latest.values), dt=dt),
        raw_mse(sets),
        latest.figure,
        latest.evaluations,
        interrupted,
    )


def raw_mse(sets: Sequence[TuningSet]) -> float:
    """Return the MSE of the angle with no correction of motion, mean over recordings [deg^2]."""
    off = replace(sets[0].setup.correction, euler=False, centrifugal=False, wheel=False, yaw=False)
    return corrected_mse(sets, off)


def corrected_mse(sets: Sequence[TuningSet], settings: CorrectionSettings) -> float:
    """Return the MSE of the corrected angle, mean over recordings [deg^2]."""
    return _merit(sets, settings).figure


def _merit(sets: Sequence[TuningSet], settings: CorrectionSettings) -> Merit:
    def angle_of(each: TuningSet) -> FloatArray:
        return correct(each.samples, replace(each.setup, correction=settings)).field("angle")

    return merit_of(sets, angle_of, Objective())


def _changed(base: CorrectionSettings, values: Mapping[str, float]) -> CorrectionSettings:
    changes: dict[str, Any] = dict(values)
    return replace(base, **changes)


def _searched(base: CorrectionSettings, sets: Sequence[TuningSet]) -> list[str]:
    names = []
    if base.euler:
        names.append("rate_time_constant")
    if base.wheel and any(each.has_wheels for each in sets):
        names.append("velocity_time_constant")
    return names
