"""Calibrations into a configuration folder, with where each value comes from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..disk.bounded_yaml import SIZE_LIMIT
from ..disk.reading import read_text
from ..disk.writing import write_texts
from ..errors import ConfigurationError
from ..filters import is_filter
from ..robot import Calibration, Robot, Setup
from .files import FILES, section_text
from .ros_yaml import number, read_parameters

VERBS = ("still", "poses", "geometry")
"""Actions that write their provenance into the files."""
_ORIGIN = "start"


def save(
    folder: Path,
    start: Path | None,
    setup: Setup,
    verb: str,
    provenance: Mapping[str, Any],
    replace: bool,
) -> list[str]:
    """Write `robot.yaml` and `calibration.yaml`, and carry the rest of the start folder over.

    Args:
        folder: where to write; made where it is missing.
        start: the configuration that was started from, where there was one.
        setup: what to write.
        verb: which calibration found it.
        provenance: where it comes from; that of other calibrations stays beside it.
        replace: whether existing files may be replaced.

    Returns:
        What was done to each file, as sentences.

    Raises:
        ConfigurationError: a file exists and `replace` is not set, or holds what would be lost.
        WritingError: they cannot be written; on a full disk all are as before.
    """
    sections: dict[str, Robot | Calibration] = {
        "robot": setup.robot,
        "calibration": setup.calibration,
    }
    targets = {name: folder / f"{name}.yaml" for name in sections}
    existing = [path for path in targets.values() if path.exists()]
    if existing and not replace:
        raise ConfigurationError(
            f"{', '.join(map(str, existing))}: exists already; `overwrite` lets it be replaced"
        )
    known = {name: _provenance(start, folder, name) for name in sections}
    contents = {
        path: section_text(
            sections[name], {**known[name], verb: dict(provenance)}, _stated(start or folder, name)
        )
        for name, path in targets.items()
    }
    done = [f"{'replaced' if path in existing else 'wrote'} {path}" for path in contents]
    rest = None if start is None else start / FILES[2]
    if rest is not None and rest.is_file() and not (folder / FILES[2]).exists():
        contents[folder / FILES[2]] = read_text(rest, SIZE_LIMIT, ConfigurationError)
        done.append(f"copied {rest} to {folder / FILES[2]}")
    write_texts(contents)
    return done


def _provenance(start: Path | None, folder: Path, name: str) -> dict[str, Any]:
    """Return the provenance so far; refuse files with entries that would be lost."""
    kept: dict[str, Any] = {}
    for source in dict.fromkeys((folder, start)):
        path = None if source is None else source / f"{name}.yaml"
        if path is None or not path.is_file():
            continue
        for entry in read_parameters(path):
            owner, _, rest = entry.name.partition(".")
            if owner == "provenance" and source == (start or folder):
                _keep(kept, rest, entry.value)
            elif owner not in (name, "provenance") and not is_filter(owner) and source == folder:
                raise ConfigurationError(
                    f"{path}: holds {entry.name}, which replacing would lose; write elsewhere"
                )
    return kept


def _stated(source: Path, name: str) -> dict[str, dict[str, float]]:
    """Return the entries of a file for filters, such as the accuracy of the calibration."""
    path = source / f"{name}.yaml"
    values: dict[str, dict[str, float]] = {}
    for entry in read_parameters(path) if path.is_file() else ():
        owner, _, parameter = entry.name.partition(".")
        if is_filter(owner):
            values.setdefault(owner, {})[parameter] = number(entry)
    return values


def _keep(kept: dict[str, Any], name: str, value: Any) -> None:
    verb, dot, rest = name.partition(".")
    if dot and verb in (*VERBS, _ORIGIN):
        kept.setdefault(verb, {})[rest] = value
    else:
        kept.setdefault(_ORIGIN, {})[name] = value
