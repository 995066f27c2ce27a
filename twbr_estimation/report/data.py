"""Everything a report shows about one recording, computed once."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..batch import run_filter
from ..configuration.of_recording import TERMS
from ..drives import Drive, Runs
from ..errors import RecordingError
from ..filters import filter_named
from ..noise.analysis import MotionSpectra, motion_of
from ..recording import FloatArray, TiltTrack
from ..scoring.score import mean_square_error
from .quality import Quality, quality_of

RAW = "raw angle"
"""Name of the angle of the readings as they are, without any correction."""


@dataclass(frozen=True, slots=True)
class TermEffect:
    """Effect of one choice of correction on the errors."""

    name: str
    angle_mse_deg2: float
    """Of the corrected angle itself, Laddach 2022 (13)."""
    filter_mse_deg2: float
    """Of the active filter."""


@dataclass(frozen=True, slots=True)
class RecordingReport:
    """One recording's part of a report."""

    runs: Runs
    raw: TiltTrack
    quality: Quality
    motion: MotionSpectra | None
    """Spectra; None where there can be none."""
    no_motion: str
    """Why there are no spectra; empty where there are."""
    effects: tuple[TermEffect, ...]
    """Empty without a reference."""

    @property
    def reference(self) -> str:
        """Reference of the errors, in words."""
        if self.runs.recording.reference is None:
            return "none"
        if self.runs.smoothed is None or self.runs.drive.recording.reference is not None:
            return "encoder"
        deviation = math.degrees(self.runs.smoothed.deviation)
        return f"smoothed from the recording itself, +-{deviation:.3f} deg by its own account"

    @property
    def ranked(self) -> tuple[str, ...]:
        """Names of the estimators, the best first; without a reference as they were run."""
        score = self.runs.score
        if score is None:
            return tuple(self.runs.tracks)
        return tuple(sorted(score.estimators, key=lambda name: score.estimators[name].mse_deg2))

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the estimators that a plot shows unasked: the best, and the active filter."""
        ours = [name for name in self.ranked if name in self.runs.parameters]
        best = ours[:1] if self.runs.score is not None else []
        wanted = [*best, self.runs.drive.settings.filter, *self.runs.recording.estimators]
        return tuple(dict.fromkeys(name for name in wanted if name in self.runs.tracks))


def collect(runs: Runs) -> RecordingReport:
    """Analyse one recording and what was run on it.

    Raises:
        TwbrError: the recording or the configuration cannot be used.
    """
    raw = runs.drive.uncorrected.corrected_samples
    return RecordingReport(
        runs,
        TiltTrack(raw.stamps, raw.field("angle")),
        quality_of(runs),
        *_motion(runs.compared),
        tuple(_effects(runs)),
    )


def _motion(drive: Drive) -> tuple[MotionSpectra | None, str]:
    try:
        return motion_of(drive), ""
    except RecordingError as error:
        return None, str(error)


def _stages(drive: Drive) -> Iterator[tuple[str, Drive]]:
    """Yield the correction's stages: nothing, calibration, each motion term alone, all."""
    yield "readings as they are", drive.uncorrected
    yield "calibration", drive.with_terms()
    for term in TERMS:
        yield f"calibration, {term}", drive.with_terms(term)
    yield "calibration, all terms", drive.with_terms(*TERMS)


def _effects(runs: Runs) -> Iterator[TermEffect]:
    drive = runs.compared
    if (association := drive.association) is None:
        return
    entry = filter_named(drive.settings.filter)
    parameters = entry.configure(
        runs.parameters.get(entry.name, drive.settings.values.get(entry.name))
    )
    stamps = drive.samples.stamps
    start, reference = int(stamps[0]) + round(drive.options.skip * 1e9), association.at(stamps)
    known: list[tuple[FloatArray, FloatArray]] = []
    if entry.name in runs.parameters and drive.corrected is drive.corrected_samples:
        known.append((drive.corrected.columns, runs[entry.name].tilt))
    for name, stage in _stages(drive):
        corrected = stage.corrected_samples
        columns = corrected.columns
        found = (tilt for input_, tilt in known if np.array_equal(input_, columns))
        if (tilt := next(found, None)) is None:  # a term without its sensor changes nothing
            tilt = run_filter(entry, parameters, corrected, stage.setup.robot).tilt
            known.append((columns, tilt))
        errors = (
            mean_square_error(stamps, each, reference, start)
            for each in (corrected.field("angle"), tilt)
        )
        yield TermEffect(name, *errors)
