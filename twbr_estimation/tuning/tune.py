"""From recordings on disk to a tuned `filters.yaml`, without ROS."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bags import TopicNames, recordings_below
from ..configuration.files import write_settings
from ..configuration.filter_settings import DT_TOLERANCE, Settings
from ..configuration.of_recording import configuration
from ..configuration.presets import preset
from ..drives import Drive, load
from ..drives.warnings import contradictions
from ..errors import ConfigurationError, RecordingError
from ..filters import filter_named, listed_filters
from ..printing.text import counted
from ..recording import Recording
from ..robot import CorrectionSettings
from ..samples import READINGS
from ..scoring.score import ScoringOptions
from ..workers import Workers
from .correction import TunedCorrection, tune_correction
from .filter import TunedFilter, TuningTask
from .objective import Objective, TuningSet, prepare
from .search import tunable
from .several import tune_filters
from .warnings import saturation_warnings

LEAST_SAMPLES = 100
"""Shortest recording that parameters are fitted to; fewer samples fit anything."""
SHARED_SAMPLES = 0.01
"""Two recordings with a larger share of equal IMU readings are one, or parts of one."""
START_PRESET = "table2"
"""Preset whose values are among those a search starts from."""

Report = Callable[[str, float], None]
"""Takes the name of what is tuned and its best figure so far [deg^2]."""
Smoothing = Callable[[str, float], None]
"""Takes the recording that is smoothed and the share that is done, 0 to 1."""


@dataclass(frozen=True, slots=True)
class TuningRequest:
    """Filters to tune and recordings to tune on."""

    training: tuple[Path, ...]
    verification: tuple[Path, ...] = ()
    names: tuple[str, ...] = ()
    """Filters to tune; all that have something to tune where empty."""
    objective: Objective = field(default_factory=Objective)
    keep_correction: bool = False
    """Whether the correction's low-pass constants stay as configured."""
    preset: str | None = None
    config: Path | None = None
    topics: TopicNames = field(default_factory=TopicNames)
    options: ScoringOptions = field(default_factory=ScoringOptions)
    seed: int = 0
    thorough: bool = False
    """Whether filters of many parameters are searched globally, too."""
    smooth: bool = False
    """Whether recordings without a reference are smoothed to have one."""
    accept_contradictions: bool = False
    """Whether recordings that fail their checks are tuned on, too."""

    def chosen(self) -> tuple[str, ...]:
        """Return the filters to tune.

        Raises:
            ConfigurationError: an unknown filter, or one without anything to tune.
        """
        if not self.names or "all" in self.names:
            return tuple(name for name, entry in listed_filters().items() if tunable(entry))
        for name in self.names:
            if not tunable(filter_named(name)):
                raise ConfigurationError(f"filter {name} has no parameter to tune")
        return tuple(dict.fromkeys(self.names))


@dataclass(frozen=True, slots=True)
class TuningResult:
    """A tuned correction and tuned filters."""

    dt: float
    """Sampling period they belong to [s]."""
    correction: CorrectionSettings
    tuned_correction: TunedCorrection | None
    """None where the correction was kept."""
    filters: tuple[TunedFilter, ...]
    training: tuple[str, ...]
    verification: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the search."""
        first = self.tuned_correction is not None and self.tuned_correction.interrupted
        return first or any(each.interrupted for each in self.filters)

    @property
    def best(self) -> TunedFilter | None:
        """The filter with the smallest verification (else training) MSE, if there is one."""
        return min(self.filters, key=lambda each: each.judged_mse_deg2, default=None)


def tune(
    request: TuningRequest,
    workers: Workers,
    report: Report,
    smoothing: Smoothing = lambda source, share: None,
) -> TuningResult:
    """Tune first the correction's low-pass constants, then the filters.

    Ctrl-C ends the search and keeps the best so far.

    Raises:
        TwbrError: recordings or configuration that cannot be used, or workers that fail.
    """
    names = request.chosen()
    doubted: list[str] = []
    training = _sets(request, request.training, smoothing, doubted)
    verification = _sets(request, request.verification, smoothing, doubted)
    _require_different(training, verification)
    dt = _common_period([*training, *verification])
    tuned = None
    correction = replace(training[0].setup.correction, dt=dt)
    if not request.keep_correction:
        tuned = tune_correction(training, request.seed, lambda best, _: report("correction", best))
        correction = tuned.settings
        training = [each.corrected_with(correction) for each in training]
        verification = [each.corrected_with(correction) for each in verification]
    done: list[TunedFilter] = []
    if tuned is None or not tuned.interrupted:
        task = TuningTask(
            tuple(training),
            tuple(verification),
            request.objective,
            _starts(request, dt),
            request.seed,
            request.thorough,
        )
        done = tune_filters(task, names, workers, lambda name, best, _: report(name, best))
    return TuningResult(
        dt,
        correction,
        tuned,
        tuple(done),
        tuple(each.source for each in training),
        tuple(each.source for each in verification),
        (*saturation_warnings(training), *doubted),
    )


def _sets(
    request: TuningRequest, paths: Sequence[Path], smoothing: Smoothing, doubted: list[str]
) -> list[TuningSet]:
    """Return the recordings below the paths; what their checks find is added to `doubted`."""
    found = dict.fromkeys(bag for path in paths for bag in recordings_below(path))
    drives = [_opened(request, bag) for bag in found]
    if not request.accept_contradictions:
        _require_agreement(drives)
    sets = []
    for bag, drive in zip(found, drives, strict=True):
        doubted += [f"{bag}: {text}" for text in drive.doubts]
        if drive.recording.reference is None:
            track = drive.smoothed(progress=partial(smoothing, str(bag)))
            drive = drive.with_reference(track.as_track())
        sets.append(prepare(drive))
    return sets


def _opened(request: TuningRequest, bag: Path) -> Drive:
    drive = load(
        bag,
        config=request.config,
        preset=request.preset,
        topics=request.topics,
        options=request.options,
        required=() if request.smooth else ("reference",),
    )
    _require_enough(drive.recording)
    return drive


def _require_agreement(drives: Sequence[Drive]) -> None:
    """Refuse drives whose data contradict each other: parameters would make up for that."""
    if failed := contradictions(drives):
        raise RecordingError(
            f"{'; '.join(failed)}. Parameters tuned on data that contradict each other fit the "
            "contradiction: mend it, or tune with `accept_contradictions` all the same"
        )


def _require_enough(recording: Recording) -> None:
    samples = recording.imu.stamps.size
    if samples < LEAST_SAMPLES:
        raise RecordingError(
            f"{recording.source}: {counted(samples, 'sample')} ({recording.duration:.3g} s): too "
            f"few to tune on; at least {LEAST_SAMPLES} samples are needed, and a minute of driving "
            "is good"
        )


def _require_different(training: Sequence[TuningSet], verification: Sequence[TuningSet]) -> None:
    digests = [_digests(each) for each in training]
    for other in verification:
        own = _digests(other)
        for known, digest in zip(training, digests, strict=True):
            share = float(np.isin(own, digest).mean())
            if share > SHARED_SAMPLES:
                raise RecordingError(
                    f"{other.source}: {100 * share:.0f} % of its IMU readings are those of the "
                    f"training recording {known.source}; verification needs another recording"
                )


def _digests(each: TuningSet) -> NDArray[np.int64]:
    """Return a number for each IMU reading, the same for equal readings.

    Stamps and names do not count: a copy, a part and a recording under another name are seen.
    """
    rows = each.samples.fields(*READINGS)
    packed, size = rows.tobytes(), rows.shape[1] * rows.itemsize
    starts = range(0, len(packed), size)
    return np.fromiter((hash(packed[start : start + size]) for start in starts), np.int64)


def _common_period(sets: Sequence[TuningSet]) -> float:
    """Return the mean sampling period.

    Raises:
        RecordingError: the recordings differ in it.
    """
    first = sets[0]
    for each in sets:
        if abs(each.dt / first.dt - 1.0) > DT_TOLERANCE:
            raise RecordingError(
                f"{each.source}: sampled every {1e3 * each.dt:g} ms, {first.source} every "
                f"{1e3 * first.dt:g} ms; parameters belong to one sampling period"
            )
    return math.fsum(each.dt for each in sets) / len(sets)


def _starts(request: TuningRequest, dt: float) -> dict[str, list[Mapping[str, float]]]:
    """Return the preset's values and those of the configuration by filter."""
    starts: dict[str, list[Mapping[str, float]]] = {}
    _, printed = preset(START_PRESET, dt)
    _, configured = configuration(request.training[0], dt, request.config, request.preset)
    for settings in (printed, configured):
        for name, values in settings.values.items():
            if values not in starts.setdefault(name, []):
                starts[name].append(values)
    return starts


def write_tuned(
    path: Path, result: TuningResult, provenance: Mapping[str, str], replace: bool = False
) -> None:
    """Write what was tuned as a parameter file, with what is known about it.

    Args:
        path: file to write.
        result: what tuning found.
        provenance: where it comes from: command, date.
        replace: whether an existing file may be replaced.

    Raises:
        ConfigurationError: the file exists and `replace` is not set.
    """
    best = result.best
    settings = Settings(
        {each.name: each.values for each in result.filters},
        **({} if best is None else {"filter": best.name}),
        dt=result.dt,
    )
    known = {**provenance, **_findings(result)}
    write_settings(path, settings, result.correction, known, replace)


def _findings(result: TuningResult) -> dict[str, object]:
    found: dict[str, object] = {
        "interrupted": result.interrupted,
        "training": list(result.training),
    }
    if result.verification:
        found["verification"] = list(result.verification)
    if result.tuned_correction is not None:
        found["correction"] = {
            "mse_before_deg2": result.tuned_correction.mse_before_deg2,
            "mse_after_deg2": result.tuned_correction.mse_after_deg2,
        }
    if result.warnings:
        found["warnings"] = list(result.warnings)
    return {**found, **{each.name: _about(each) for each in result.filters}}


def _about(tuned: TunedFilter) -> dict[str, object]:
    about: dict[str, object] = {"training_mse_deg2": tuned.training_mse_deg2}
    if tuned.verification_mse_deg2 is not None:
        about["verification_mse_deg2"] = tuned.verification_mse_deg2
    if tuned.eigenvalue_moduli:
        about["eigenvalue_moduli"] = list(tuned.eigenvalue_moduli)
    if tuned.warnings:
        about["warnings"] = list(tuned.warnings)
    if tuned.interrupted:
        about["interrupted"] = True
    return about
