"""From a recording on disk to a `Drive`: topics, robot, calibration, settings."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..bags import TopicNames, read_recording
from ..configuration.of_recording import CONFIG_FOLDER, TERMS, configuration, origin_of, with_terms
from ..disk.reading import is_folder
from ..errors import ConfigurationError
from ..samples import RESTART_GAP
from ..scoring.errors import ScoringOptions
from .drive import Drive

_DEFAULT_ROBOT = "geometry is that of `Robot`'s defaults, calibration none"


def load(
    path: str | Path,
    *,
    config: str | Path | None = None,
    preset: str | None = None,
    terms: Sequence[str] | None = None,
    loop_period: float = 0.0,
    topics: TopicNames | None = None,
    estimators: Mapping[str, str] | None = None,
    options: ScoringOptions | None = None,
    required: Sequence[str] = (),
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
    require_period(loop_period)
    if terms is not None:
        _require_terms(terms)
    recording = read_recording(folder, topics or TopicNames(), estimators or {}, tuple(required))
    setup, settings = configuration(folder, max(loop_period, recording.dt), chosen, preset)
    if terms is not None:
        setup = with_terms(setup, terms)
    notes: tuple[str, ...] = ()
    if chosen is None and not is_folder(folder / CONFIG_FOLDER):
        notes = (f"{path}: no robot is described there and no `config` given; {_DEFAULT_ROBOT}",)
    if mixed := origin_of(folder, chosen):
        notes = (*notes, f"configuration: {mixed}")
    return Drive(recording, setup, settings, options or ScoringOptions(), loop_period, notes)


def _path(argument: str, value: str | Path) -> Path:
    if not isinstance(value, (str, os.PathLike)):
        raise ConfigurationError(f"`{argument}`: {value!r} is neither a str nor a Path")
    return Path(value).expanduser()


def require_period(loop_period: float) -> None:
    """Raise where samples cannot be combined for this period.

    Raises:
        ConfigurationError: it is negative, or so long that filters would start again.
    """
    if not 0.0 <= loop_period <= RESTART_GAP:
        raise ConfigurationError(
            f"`loop_period`: {loop_period:g} s is not within 0 and {RESTART_GAP:g} s"
        )


def _require_terms(terms: Sequence[str]) -> None:
    for name in (terms,) if isinstance(terms, str) else terms:
        if name not in TERMS:
            raise ConfigurationError(f"`terms`: there is no {name!r}; there are {', '.join(TERMS)}")
