"""Which files make up a recording, and which recordings lie below a folder."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from ..disk.bounded_yaml import load_yaml
from ..disk.faults import reason_of
from ..disk.partials import PARTIAL, restore
from ..disk.reading import exists
from ..errors import RecordingError
from .packed_files import PACKED_SUFFIXES

_METADATA = "metadata.yaml"
_CONFIGURATION = "config"
_METADATA_SIZE = 1 << 24
_METADATA_VALUES = 300_000
_PLAIN = (".mcap", ".db3", ".bag")
_SUFFIXES = (*_PLAIN, *(plain + packed for plain in _PLAIN for packed in PACKED_SUFFIXES))


def bag_files(path: Path) -> tuple[list[Path], Counter[str]]:
    """Return the files of a recording, and remarks about them.

    Of a rosbag2 directory these are the files that its metadata lists, under their name with or
    without an ending of compression. A directory without usable `metadata.yaml` (the recorder
    was killed) counts with the bag files that lie in it.

    Raises:
        RecordingError: nothing there, or nothing that could be read.
    """
    try:
        restore(path)
        if not path.exists():
            raise RecordingError(f"{path}: there is no such recording")
        if not path.is_dir():
            return [path], Counter()
        there = _bags_in(path)
        if (path / _METADATA).exists():
            return _listed(path, there)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {reason_of(error)}") from None
    if not there:
        raise RecordingError(f"{path}: the directory holds no recording")
    return there, Counter()


def is_bag_name(name: str) -> bool:
    """Return whether a file of this name is a bag, packed or not."""
    return name.endswith(_SUFFIXES)


def _bags_in(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if is_bag_name(file.name))


def _listed(folder: Path, there: list[Path]) -> tuple[list[Path], Counter[str]]:
    """Return the listed files that are there, and remarks."""
    metadata = folder / _METADATA
    remarks: Counter[str] = Counter()
    try:
        names = _names(metadata)
    except RecordingError as error:
        if not there:
            raise
        reason = str(error).removeprefix(f"{metadata}: ")
        remarks[f"{_METADATA}: {reason}; the bag files beside it are read"] = 1
        return there, remarks
    found = {name: _under_its_name(folder, name) for name in names}
    files = list(dict.fromkeys(file for file in found.values() if file is not None))
    missing = [name for name, file in found.items() if file is None]
    if not files:
        beside = f"; there are: {', '.join(file.name for file in there)}" if there else ""
        raise RecordingError(
            f"{folder}: {_METADATA} lists missing files: {', '.join(missing)}{beside}"
        )
    if missing:
        remarks[f"{_METADATA} lists missing files: {', '.join(missing)}"] = len(missing)
    if unlisted := [file.name for file in there if file not in files]:
        remarks[f"files that {_METADATA} does not list left out: {', '.join(unlisted)}"] = len(
            unlisted
        )
    return files, remarks


def _names(metadata: Path) -> list[str]:
    """Return the names of the files that the metadata list."""
    content = load_yaml(metadata, RecordingError, _METADATA_SIZE, _METADATA_VALUES)
    try:
        listed = content["rosbag2_bagfile_information"]["relative_file_paths"]
        names = [Path(name).name for name in listed if isinstance(name, str)]
    except (KeyError, TypeError, IndexError):
        names = []
    if not names or "" in names:
        raise RecordingError(f"{metadata}: not the metadata of a rosbag2: no relative_file_paths")
    return names


def _under_its_name(folder: Path, name: str) -> Path | None:
    """Return the listed file, also where it was compressed or unpacked by hand since."""
    bare = name
    for suffix in PACKED_SUFFIXES:
        bare = bare.removesuffix(suffix)
    candidates = (name, bare, *(bare + suffix for suffix in PACKED_SUFFIXES))
    return next((folder / each for each in candidates if exists(folder / each)), None)


def recordings_below(path: Path) -> list[Path]:
    """Return the recordings of a directory tree; a recording itself gives itself.

    A directory with `metadata.yaml`, or with files that bear its own name (their recorder was
    killed), is one recording, and so is one with a single bag file beside its configuration. In
    another one every bag file is a separate recording.

    Raises:
        RecordingError: nothing there, or no recording below it.
    """
    if not exists(path):
        raise RecordingError(f"{path}: there is no such recording")
    try:
        if not path.is_dir():
            return [path]
        found = _below(path)
    except OSError as error:
        raise RecordingError(f"{error.filename}: cannot be read: {reason_of(error)}") from None
    if not found:
        raise RecordingError(f"{path}: there is no recording in this directory")
    return found


def _below(folder: Path) -> list[Path]:
    entries = sorted(folder.iterdir())
    bags = [entry for entry in entries if is_bag_name(entry.name)]
    if (folder / _METADATA).exists() or any(_named_after(folder, bag) for bag in bags):
        return [folder]
    folders = [entry for entry in entries if entry.is_dir()]
    if len(bags) == 1 and [each.name for each in folders] == [_CONFIGURATION]:
        return [folder]
    for entry in folders:
        if not entry.name.endswith(PARTIAL):
            bags += _below(entry)
    return bags


def _named_after(folder: Path, bag: Path) -> bool:
    return re.match(rf"{re.escape(folder.resolve().name)}_\d+\.", bag.name) is not None
