"""From a recording on disk to a `Drive`: topics, robot, calibration, settings."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..bags import TopicNames, read_recording
from ..configuration.of_recording import (
    CONFIG_FOLDER,
    configuration,
    origin_of,
    require_terms,
    with_terms,
)
from ..disk.reading import is_folder
from ..errors import ConfigurationError
from ..parameters.argument_checks import require_kind, require_names
from ..scoring.score import ScoringOptions
from .drive import Drive, require_period

_DEFAULT_ROBOT = "geometry is that of `Robot`'s defaults, calibration none"


def load(
    path: str | Path,
    *,
    config: str | Path | None = None,
    preset: str | None = None,
    terms: str | Sequence[str] | None = None,
    loop_period: float = 0.0,
    topics: TopicNames | None = None,
    estimators: Mapping[str, str] | None = None,
    options: ScoringOptions | None = None,
    required: str | Sequence[str] = (),
) -> Drive:
    """Read a recording; it is paired and corrected when that is first needed.

    Args:
        path: a bag (MCAP, SQLite or ROS 1), as folder or file.
        config: folder with robot.yaml, calibration.yaml, filters.yaml; files it lacks come from
            the folder `config` in the recording, as all do by default.
        preset: name of filter settings of the package, in place of those of the folder.
        terms: motion terms that the correction removes; by default as configured.
        loop_period: period [s] for which samples are combined before the filters; 0 takes each.
        topics: names of topics and joints where they differ from the usual ones.
        estimators: topics of further estimators in the recording, by a name for each.
        options: how estimates are compared with the reference.
        required: what the recording must have: "reference", "joint_states".

    Raises:
        ConfigurationError: settings that cannot be read or used.
        RecordingError: a recording that cannot be read or lacks what is required.
    """
    folder = _path("path", path)
    chosen = None if config is None else _path("config", config)
    period = require_period(loop_period)
    given = TopicNames() if topics is None else topics
    require_kind("topics", given, TopicNames, "TopicNames")
    compared = ScoringOptions() if options is None else options
    require_kind("options", compared, ScoringOptions, "ScoringOptions")
    roles = require_names("required", required)
    switched = None if terms is None else require_terms(require_names("terms", terms))
    recording = read_recording(folder, given, _topics(estimators), roles)
    setup, settings = configuration(folder, max(period, recording.dt), chosen, preset)
    if switched is not None:
        setup = with_terms(setup, switched)
    notes: tuple[str, ...] = ()
    if chosen is None and not is_folder(folder / CONFIG_FOLDER):
        notes = (f"{path}: no robot is described there and no `config` given; {_DEFAULT_ROBOT}",)
    if mixed := origin_of(folder, chosen):
        notes = (*notes, f"configuration: {mixed}")
    return Drive(recording, setup, settings, compared, period, notes)


def _path(argument: str, value: str | Path) -> Path:
    require_kind(argument, value, (str, os.PathLike), "a str or a Path")
    if value == "":
        raise ConfigurationError(f"`{argument}`: the text is empty")
    return Path(value).expanduser()


def _topics(estimators: Mapping[str, str] | None) -> dict[str, str]:
    """Return the topics of further estimators by name."""
    given = {} if estimators is None else estimators
    require_kind("estimators", given, Mapping, "a mapping of names to topics")
    require_names("estimators", (*given, *given.values()))
    return dict(given)
