"""From a recording on disk to the errors of every estimator, without ROS."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from . import batch
from .bags import TopicNames, read_recording, write_recording
from .configuration.filter_settings import Settings
from .configuration.of_recording import CONFIG_FOLDER, configuration, with_terms
from .errors import ConfigurationError
from .filters import filter_named, filters
from .pipeline.saturation import SATURATION_MARGIN
from .recording import FloatArray, Recording, TiltTrack
from .robot import CorrectionSettings, Setup
from .scoring.errors import SMOOTHED, Options, RecordingScore, score_recording
from .scoring.plausibility import doubts
from .smoothing import SMOOTHER, Progress, SmoothedTrack, smooth_recording

_DEFAULT_ROBOT = "geometry is that of `Robot`'s defaults, calibration none"
NOTEWORTHY_SATURATION = 0.001
"""A larger share of saturated samples is worth a warning."""


@dataclass(frozen=True, slots=True)
class Request:
    """What to run on a recording, and how to compare it."""

    names: tuple[str, ...] = ()
    """Filters to run; all where empty."""
    preset: str | None = None
    config: Path | None = None
    """Folder with robot.yaml, calibration.yaml, filters.yaml; by default the recording's own."""
    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Single parameter values by filter; they rule over preset and configuration."""
    terms: tuple[str, ...] | None = None
    """Motion terms to remove; None leaves the configuration's choice."""
    topics: TopicNames = field(default_factory=TopicNames)
    estimators: Mapping[str, str] = field(default_factory=dict)
    """Topics of further estimators in the recording, by name."""
    options: Options = field(default_factory=Options)
    loop_period: float = 0.0
    """Period [s] for which samples are combined before the filters; 0 takes each."""
    smooth: bool = False
    """Whether the recording is smoothed, as a reference where it has none, else beside it."""

    def chosen(self) -> tuple[str, ...]:
        """Return the filters to run.

        Raises:
            ConfigurationError: there is no such filter, a value belongs to none of them, or an
                estimator bears the name of one.
        """
        names = tuple(
            filter_named(name).name for name in dict.fromkeys(self.names) if name != "all"
        )
        if not names or "all" in self.names:
            names = tuple(filters())
        for name in self.values:
            if filter_named(name).name not in names:
                raise ConfigurationError(f"{name} has values but does not run; name it, too")
        for name in self.estimators:
            if name in filters():
                raise ConfigurationError(f"estimator {name}: this is a filter's name; take another")
        return names


@dataclass(frozen=True, slots=True)
class Run:
    """A recording with all that was run on it, and with what settings."""

    recording: Recording
    setup: Setup
    settings: Settings
    values: Mapping[str, Mapping[str, float]]
    """Parameter values in force by filter; missing ones are the filter's defaults."""
    tracks: Mapping[str, TiltTrack]
    """Tilt by name of the filter or of the recording's own estimator."""
    warnings: tuple[str, ...]
    score: RecordingScore | None
    """None where the recording has no reference."""
    smoothed: SmoothedTrack | None = None
    """The tilt with hindsight, where it was asked for."""


def run(
    path: Path,
    request: Request,
    *,
    reference: bool = True,
    progress: Progress = lambda share: None,
) -> Run:
    """Run the requested filters on a recording and score them where there is a reference.

    Args:
        path: the recording.
        request: what to run.
        reference: whether the recording must have a reference, or be smoothed.
        progress: told how far the smoothing is.

    Raises:
        TwbrError: the recording or the configuration cannot be used.
    """
    chosen = request.chosen()
    required = ("reference",) if reference and not request.smooth else ()
    recording = read_recording(path, request.topics, request.estimators, required)
    loop = max(request.loop_period, recording.dt)
    setup, settings = configuration(path, loop, request.config, request.preset)
    if request.terms is not None:
        setup = with_terms(setup, request.terms)
    _require_stable(setup.correction, recording.dt)
    values = {
        name: {**settings.values.get(name, {}), **request.values.get(name, {})} for name in chosen
    }
    runs = batch.estimate_recording(recording, setup, values, request.loop_period)
    tracks = {name: TiltTrack(run.stamps, run.tilt) for name, run in runs.items()}
    tracks.update(recording.estimators)
    warnings = warnings_for(recording, setup, settings, values, request.loop_period)
    if request.config is None and not (path / CONFIG_FOLDER).is_dir():
        warnings += (
            f"{path}: no robot is described there and no --config given; {_DEFAULT_ROBOT}",
        )
    smoothed, score = None, None
    if request.smooth:
        hindsight = {**settings.values.get(SMOOTHER, {}), **request.values.get(SMOOTHER, {})}
        smoothed = smooth_recording(recording, setup, hindsight, progress)
        if recording.reference is not None:
            tracks[SMOOTHED] = smoothed.as_track()
    if recording.reference is not None or smoothed is not None:
        score = _score(recording, tracks, request.options, warnings, smoothed)
    if recording.reference is None and smoothed is not None:
        recording = replace(recording, reference=smoothed.as_track())
    return Run(recording, setup, settings, values, tracks, warnings, score, smoothed)


def _score(
    recording: Recording,
    tracks: Mapping[str, TiltTrack],
    options: Options,
    warnings: Sequence[str],
    smoothed: SmoothedTrack | None,
) -> RecordingScore:
    """Compare with the encoder where there is one, else with the smoothed tilt."""
    if smoothed is None:
        return score_recording(recording, tracks, options, warnings)
    stated = math.degrees(smoothed.deviation)
    if recording.reference is not None:
        score = score_recording(recording, tracks, options, warnings)
        return replace(score, smoothed_deviation_deg=stated)
    recording = replace(recording, reference=smoothed.as_track())
    # Delay and offset are those of an encoder.
    score = score_recording(recording, tracks, Options(skip=options.skip), warnings)
    return replace(score, reference=SMOOTHED, smoothed_deviation_deg=stated)


def evaluate(path: Path, request: Request) -> RecordingScore:
    """Run the requested filters on a recording and score them against its reference.

    Raises:
        TwbrError: the recording or the configuration cannot be used.
    """
    score = run(path, request).score
    assert score is not None  # the reference was required, or made
    return score


def save_with_reference(target: Path, source: Path, run: Run) -> None:
    """Write a recording that had no reference once more, with its smoothed tilt as reference.

    Args:
        target: directory to create.
        source: the recording; its own configuration is copied.
        run: what was run on it.

    Raises:
        TwbrError: there is another reference, or the target cannot be written.
    """
    if run.smoothed is None or run.score is None or run.score.reference != SMOOTHED:
        raise ConfigurationError(f"{source}: has a reference of its own; nothing is saved")
    write_recording(target, run.recording)
    if (source / CONFIG_FOLDER).is_dir():
        shutil.copytree(source / CONFIG_FOLDER, target / CONFIG_FOLDER)


def warnings_for(
    recording: Recording,
    setup: Setup,
    settings: Settings,
    values: Mapping[str, Mapping[str, float]],
    loop_period: float = 0.0,
) -> tuple[str, ...]:
    """Return what a user should know before trusting figures made with these settings."""
    dt = max(loop_period, recording.dt)
    entries = [filter_named(name) for name in values]
    found = list(settings.warnings(dt, entries))
    for entry in entries:
        found += entry.warnings(entry.configure(values[entry.name]), dt)
    found += [*_saturation_warnings(recording, setup), *doubts(recording, setup)]
    return tuple(found)


def _require_stable(correction: CorrectionSettings, dt: float) -> None:
    """Raise where a low-pass of the correction diverges at this sampling period [s]."""
    for name in ("rate_time_constant", "velocity_time_constant"):
        value = getattr(correction, name)
        if value <= -0.5 * dt < 0.0:
            raise ConfigurationError(
                f"correction.{name}: {value:g} s is unstable at a sampling period of {dt:g} s; "
                f"it must be above {-0.5 * dt:g} s"
            )


def _saturation_warnings(recording: Recording, setup: Setup) -> list[str]:
    found = []
    robot, imu = setup.robot, recording.imu
    for name, values, limit in (
        ("gyro", imu.gyro, robot.gyro_range),
        ("accelerometer", imu.accel, robot.accel_range),
    ):
        share = saturated_share(values, limit)
        if share > NOTEWORTHY_SATURATION:
            found.append(f"{name}: {100 * share:.2f} % of the samples are saturated")
    return found


def saturated_share(values: FloatArray, limit: float) -> float:
    """Return the share of readings (n, 3) with an axis at full scale."""
    return float(np.mean(np.any(np.abs(values) >= SATURATION_MARGIN * limit, axis=1)))
