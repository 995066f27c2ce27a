"""Configuration as ROS parameter files: `robot.yaml`, `calibration.yaml`, `filters.yaml`.

The same files configure the nodes. Under `/**` every name must be known; under a node's own
name further parameters of that node may stand, which are left to it. Of several files the later
one takes precedence, as for nodes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, fields
from datetime import datetime, timezone
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

from .. import __version__
from ..disk.reading import is_folder
from ..errors import ConfigurationError
from ..filters import filter_named, filters, is_filter
from ..parameters.argument_checks import require_kind
from ..parameters.bounds import hints_of
from ..robot import Calibration, CorrectionSettings, Robot, Setup
from .filter_settings import DEFAULT_FILTER, Settings
from .ros_yaml import (
    Entry,
    converted,
    number,
    parameters_text,
    read_parameters,
    write_parameters,
)

FILES = ("robot.yaml", "calibration.yaml", "filters.yaml")
"""Files that are read from a folder, in this order."""

_SECTIONS: Mapping[str, type[Any]] = {
    "robot": Robot,
    "calibration": Calibration,
    "correction": CorrectionSettings,
}
_SCALARS = ("filter", "settings_dt")
_ANYTHING_BELOW = ("provenance", "qos_overrides", "use_sim_time")

Section = TypeVar("Section", Robot, Calibration, CorrectionSettings)
PathLike = str | Path
_HEADER = f"Written by twbr_estimation {__version__}. SI units and radians."


def read_setup(*paths: PathLike) -> Setup:
    """Return robot, calibration and correction settings from folders or files.

    Raises:
        ConfigurationError: a file that cannot be read, an unknown key, a value of the wrong
            type or out of range; the message names file, key, value and limit.
    """
    entries = _entries(paths)
    return Setup(
        _section(Robot, "robot", entries),
        _section(Calibration, "calibration", entries),
        _correction(entries) or CorrectionSettings(),
    )


def read_correction(*paths: PathLike) -> CorrectionSettings | None:
    """Return the correction settings, or None where the files hold none.

    Raises:
        ConfigurationError: as `read_setup`.
    """
    return _correction(_entries(paths))


def read_settings(*paths: PathLike) -> Settings:
    """Return the filters' parameter values, their sampling period and the filter's name.

    Raises:
        ConfigurationError: as `read_setup`.
    """
    entries = _entries(paths)
    values: dict[str, dict[str, float]] = {}
    for entry in entries.values():
        owner, _, name = entry.name.partition(".")
        if is_filter(owner):
            values.setdefault(owner, {})[name] = _filter_value(owner, name, entry)
    return Settings(
        values,
        _filter_name(entries.get("filter")),
        _period(entries.get("settings_dt")),
        ", ".join(str(path) for path in paths),
    )


def date_of_now() -> str:
    """Return the time in UTC, in a form that YAML takes for text.

    `ros2 param load` reads each value as YAML again and cannot send what becomes a date.
    """
    return f"{datetime.now(timezone.utc):%Y-%m-%d at %H:%M:%S UTC}"


def write_section(
    path: PathLike,
    section: Robot | Calibration,
    provenance: Mapping[str, object] | None = None,
    replace: bool = False,
    values: Mapping[str, Mapping[str, float]] | None = None,
) -> None:
    """Write `robot.yaml` or `calibration.yaml`.

    Args:
        path: File to write.
        section: What to write.
        provenance: Where the values come from (source, date, figures), kept in the file.
        replace: Whether an existing file may be replaced.
        values: Parameter values by filter that stand in the file, too.

    Raises:
        ConfigurationError: the file exists and `replace` is not set.
        WritingError: it cannot be written.
    """
    _write(path, _of_section(section, values), provenance, replace)


def section_text(
    section: Robot | Calibration,
    provenance: Mapping[str, object],
    values: Mapping[str, Mapping[str, float]],
) -> str:
    """Return what `write_section` writes."""
    return parameters_text(_with(_of_section(section, values), provenance), _HEADER)


def _of_section(
    section: Robot | Calibration, values: Mapping[str, Mapping[str, float]] | None
) -> dict[str, Any]:
    name = "robot" if isinstance(section, Robot) else "calibration"
    return {name: _plain(section), **_plain_values(values or {})}


def write_settings(
    path: PathLike,
    settings: Settings,
    correction: CorrectionSettings | None = None,
    provenance: Mapping[str, object] | None = None,
    replace: bool = False,
) -> None:
    """Write `filters.yaml`; arguments and errors as `write_section`."""
    parameters: dict[str, Any] = {"filter": settings.filter}
    if settings.dt > 0.0:
        parameters["settings_dt"] = float(settings.dt)
    if correction is not None:
        parameters["correction"] = _plain(correction)
    parameters.update(_plain_values(settings.values))
    _write(path, parameters, provenance, replace)


def _plain_values(values: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    return {owner: {key: float(each) for key, each in of.items()} for owner, of in values.items()}


def _write(
    path: PathLike,
    parameters: dict[str, Any],
    provenance: Mapping[str, object] | None,
    replace: bool,
) -> None:
    write_parameters(Path(path), _with(parameters, provenance), _HEADER, replace)


def _with(parameters: dict[str, Any], provenance: Mapping[str, object] | None) -> dict[str, Any]:
    return {**parameters, "provenance": dict(provenance)} if provenance else parameters


def _plain(section: Robot | Calibration | CorrectionSettings) -> dict[str, Any]:
    """Return the fields as YAML values; ROS has no empty list, so those are left out."""
    plain: dict[str, Any] = {}
    for name, value in asdict(section).items():
        if isinstance(value, Enum):
            plain[name] = value.value
        elif isinstance(value, tuple):
            plain[name] = [float(number) for number in value]
        else:
            plain[name] = value
    return {name: value for name, value in plain.items() if value != []}


def _entries(paths: tuple[PathLike, ...]) -> dict[str, Entry]:
    """Return the files' entries by full name; the last file wins, all names are checked."""
    if not paths:
        raise ConfigurationError("`paths`: none is given; name a folder or files")
    entries: dict[str, Entry] = {}
    for path in paths:
        for file in configuration_files(path):
            for entry in read_parameters(file):
                _require_known(entry)
                entries[entry.name] = entry
    return entries


def configuration_files(path: PathLike) -> list[Path]:
    """Return the configuration files of a folder, or the one file that `path` is.

    Raises:
        ConfigurationError: there is no such path, or the folder holds none.
    """
    require_kind("paths", path, (str, os.PathLike), "a str or a Path")
    path = Path(path).expanduser()
    if not os.path.exists(path):
        raise ConfigurationError(f"{path}: cannot be read: there is no such file or folder")
    if not is_folder(path):
        return [path]
    found = [path / name for name in FILES if (path / name).is_file()]
    if not found:
        raise ConfigurationError(f"{path}: holds none of {', '.join(FILES)}")
    return found


def _require_known(entry: Entry) -> None:
    owner, _, name = entry.name.partition(".")
    if not name and (owner in _SECTIONS or is_filter(owner)):
        raise ConfigurationError(
            f"{entry.path}: {owner}: {entry.value!r} is not a mapping of names to values"
        )
    if owner in _SECTIONS:
        known = [item.name for item in fields(_SECTIONS[owner])]
        if name not in known:
            raise ConfigurationError(
                f"{entry.path}: {entry.name} is unknown; {owner} has: {', '.join(known)}"
            )
    elif is_filter(owner):
        _filter_value(owner, name, entry)
    elif entry.for_any_node and entry.name not in _SCALARS and owner not in _ANYTHING_BELOW:
        known = [*_SECTIONS, *_SCALARS, "provenance", *filters()]
        raise ConfigurationError(
            f"{entry.path}: {entry.name} is unknown; there are: {', '.join(known)}"
        )


def _filter_value(owner: str, name: str, entry: Entry) -> float:
    value = number(entry)
    try:
        filter_named(owner).configure({name: value})
    except ConfigurationError as error:
        raise ConfigurationError(f"{entry.path}: {error}") from None
    return value


def _filter_name(entry: Entry | None) -> str:
    if entry is None:
        return DEFAULT_FILTER
    try:
        return filter_named(entry.value).name
    except (ConfigurationError, TypeError) as error:
        raise ConfigurationError(f"{entry.path}: filter: {error}") from None


def _period(entry: Entry | None) -> float:
    if entry is None:
        return 0.0
    period = number(entry)
    if period <= 0.0:
        raise ConfigurationError(f"{entry.path}: {entry.name}: {period} s is not above 0")
    return period


def _correction(entries: Mapping[str, Entry]) -> CorrectionSettings | None:
    """Return the section `correction`; where it names no dt, `settings_dt` is its dt, too."""
    if not any(name.startswith("correction.") for name in entries):
        return None
    period = entries.get("settings_dt")
    if period is None:
        return _section(CorrectionSettings, "correction", entries)
    inherited = {"correction.dt": period._replace(name="correction.dt")}
    return _section(CorrectionSettings, "correction", {**inherited, **entries})


def _section(kind: type[Section], owner: str, entries: Mapping[str, Entry]) -> Section:
    resolved: Any = kind
    hints = hints_of(resolved)
    given = {
        entry.name.partition(".")[2]: entry
        for entry in entries.values()
        if entry.name.startswith(f"{owner}.")
    }
    values = {name: converted(entry, hints[name]) for name, entry in given.items()}
    try:
        return kind(**values)
    except ConfigurationError as error:
        sources = sorted({str(entry.path) for entry in given.values()})
        raise ConfigurationError(f"{', '.join(sources)}: {error}") from None
