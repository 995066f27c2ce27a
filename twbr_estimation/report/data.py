"""Everything a report shows about one recording, computed once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from .. import batch
from ..configuration.of_recording import TERMS, with_terms
from ..errors import RecordingError
from ..evaluate import Request, Run, run
from ..filters import filter_named
from ..noise.analysis import Motion, motion_of, uncorrected
from ..pipeline.pairing import SampleTrack, pair
from ..recording import TiltTrack
from ..robot import Setup
from ..scoring.errors import Options, score_recording
from .quality import Quality, quality_of

RAW = "raw angle"
"""Name of the angle of the readings as they are, without any correction."""


@dataclass(frozen=True, slots=True)
class TermEffect:
    """What one choice of correction does to the errors."""

    name: str
    angle_mse_deg2: float
    """Of the corrected angle itself, Laddach 2022 (13)."""
    filter_mse_deg2: float
    """Of the filter that speaks."""


@dataclass(frozen=True, slots=True)
class RecordingReport:
    """One recording's part of a report."""

    run: Run
    raw: TiltTrack
    quality: Quality
    motion: Motion | None
    """Spectra; None where there can be none."""
    no_motion: str
    """Why there are no spectra; empty where there are."""
    effects: tuple[TermEffect, ...]
    """Empty without a reference."""

    @property
    def ranked(self) -> tuple[str, ...]:
        """Names of the estimators, the best first; without a reference as they were run."""
        score = self.run.score
        if score is None:
            return tuple(self.run.tracks)
        return tuple(sorted(score.estimators, key=lambda name: score.estimators[name].mse_deg2))

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the estimators that a plot shows unasked: the best, and who speaks."""
        ours = [name for name in self.ranked if name in self.run.values]
        best = ours[:1] if self.run.score is not None else []
        wanted = [*best, self.run.settings.filter, *self.run.recording.estimators]
        return tuple(dict.fromkeys(name for name in wanted if name in self.run.tracks))


def collect(path: Path, request: Request) -> RecordingReport:
    """Run and analyse one recording.

    Raises:
        TwbrError: the recording or the configuration cannot be used.
    """
    done = run(path, request, reference=False)
    samples = pair(done.recording.imu, done.recording.wheels, motors=done.recording.motors)
    return RecordingReport(
        done,
        _angle(samples, uncorrected(done.setup)),
        quality_of(done),
        *_motion(done, request.options),
        tuple(_effects(done, samples, request.options)),
    )


def _motion(done: Run, options: Options) -> tuple[Motion | None, str]:
    try:
        return motion_of(done.recording, done.setup, options), ""
    except RecordingError as error:
        return None, str(error)


def _angle(samples: SampleTrack, setup: Setup) -> TiltTrack:
    return TiltTrack(samples.stamps, batch.correct(samples, setup).field("angle"))


def _stages(setup: Setup) -> Iterator[tuple[str, Setup]]:
    """Yield the correction's stages: nothing, calibration, each motion term alone, all."""
    yield "readings as they are", uncorrected(setup)
    yield "calibration", with_terms(setup, ())
    for term in TERMS:
        yield f"calibration, {term}", with_terms(setup, (term,))
    yield "calibration, all terms", with_terms(setup, TERMS)


def _effects(done: Run, samples: SampleTrack, options: Options) -> Iterator[TermEffect]:
    if done.recording.reference is None:
        return
    entry = filter_named(done.settings.filter)
    parameters = entry.configure(done.values.get(entry.name, done.settings.values.get(entry.name)))
    for name, setup in _stages(done.setup):
        corrected = batch.correct(samples, setup)
        estimate = batch.run_filter(entry, parameters, corrected, setup.robot)
        tracks = {
            "angle": TiltTrack(corrected.stamps, corrected.field("angle")),
            "filter": TiltTrack(estimate.stamps, estimate.tilt),
        }
        scores = score_recording(replace(done.recording, repairs={}), tracks, options).estimators
        yield TermEffect(name, scores["angle"].mse_deg2, scores["filter"].mse_deg2)
