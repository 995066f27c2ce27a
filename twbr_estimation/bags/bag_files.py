"""Which files make up a recording, and which recordings lie below a folder."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path, PureWindowsPath

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
_PART = re.compile(r"_(\d+)(?=\.(?:mcap|db3|bag)\b)")
"""Number of a part, as in `drive_2.mcap`."""
_SUFFIXES = (*_PLAIN, *(plain + packed for plain in _PLAIN for packed in PACKED_SUFFIXES))


def bag_files(path: Path) -> tuple[list[Path], Counter[str]]:
    """Return the files of a recording, and remarks about them.

    Of a rosbag2 directory these are the files that its metadata lists, under their name with or
    without an ending of compression. A directory without usable `metadata.yaml` (the recorder
    was killed, files were renamed) counts with the bag files that lie in it, where they are the
    parts of one recording. `metadata.yaml` itself stands for its directory.

    Raises:
        RecordingError: nothing there, or nothing that could be read.
    """
    try:
        restore(path)
        if not path.exists():
            raise RecordingError(f"{path}: there is no such recording")
        if path.name == _METADATA and path.is_file():
            path = path.parent
        if not path.is_dir():
            return [path], Counter()
        there = _bags_in(path)
        if (path / _METADATA).exists():
            return _listed(path, there)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {reason_of(error)}") from None
    if not there:
        raise RecordingError(f"{path}: the directory holds no recording")
    return _parts(path, there), Counter()


def is_bag_name(name: str) -> bool:
    """Return whether a file of this name is a bag, packed or not."""
    return name.endswith(_SUFFIXES)


def _bags_in(folder: Path) -> list[Path]:
    """Return the bag files of a folder; none that is there unpacked as well."""
    names = {file.name for file in folder.iterdir() if is_bag_name(file.name)}
    return [folder / name for name in sorted(names) if _bare(name) not in names - {name}]


def _bare(name: str) -> str:
    """Return the name of a file without an ending of compression."""
    for suffix in PACKED_SUFFIXES:
        name = name.removesuffix(suffix)
    return name


def _parts(folder: Path, bags: list[Path]) -> list[Path]:
    """Return the files of a folder without metadata, in the order of their numbers.

    Raises:
        RecordingError: they are several recordings.
    """
    if len(bags) > 1 and not _are_parts(folder, bags):
        names = ", ".join(bag.name for bag in bags)
        raise RecordingError(
            f"{folder}: without {_METADATA} these are several recordings: {names}; name one"
        )
    return sorted(bags, key=lambda bag: (_number(bag) or 0, bag.name))


def _are_parts(folder: Path, bags: list[Path]) -> bool:
    """Whether files are the parts of one recording.

    A recorder numbers them from 0, or, where the first are gone, they bear the folder's name.
    """
    if _named_after(folder, bags):
        return True
    stems = {_PART.split(bag.name)[0] for bag in bags}
    numbers = sorted(-1 if (number := _number(bag)) is None else number for bag in bags)
    return len(stems) == 1 and numbers == list(range(len(bags)))


def _number(bag: Path) -> int | None:
    found = _PART.search(bag.name)
    return int(found[1]) if found else None


def _listed(folder: Path, there: list[Path]) -> tuple[list[Path], Counter[str]]:
    """Return the listed files that are there, and remarks."""
    metadata = folder / _METADATA
    remarks: Counter[str] = Counter()
    try:
        names = _names(metadata)
    except RecordingError as error:
        if not there:
            raise
        there = _parts(folder, there)
        reason = str(error).removeprefix(f"{metadata}: ")
        remarks[f"{_METADATA}: {reason}; the bag files beside it are read"] = 1
        return there, remarks
    found = {name: _under_its_name(folder, name) for name in names}
    files = list(dict.fromkeys(file for file in found.values() if file is not None))
    missing = [name for name, file in found.items() if file is None]
    if not files:
        what = f"{_METADATA} lists missing files: {', '.join(missing)}"
        if not there:
            raise RecordingError(f"{folder}: {what}")
        remarks[f"{what}; the bag files beside it are read"] = len(missing)
        return _parts(folder, there), remarks
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
        names = [PureWindowsPath(name).name for name in listed if isinstance(name, str)]
    except (KeyError, TypeError, IndexError):
        names = []
    if not names or "" in names:
        raise RecordingError(f"{metadata}: not the metadata of a rosbag2: no relative_file_paths")
    return names


def _under_its_name(folder: Path, name: str) -> Path | None:
    """Return the listed file, also where it was compressed or unpacked by hand since."""
    bare = _bare(name)
    candidates = (name, bare, *(bare + suffix for suffix in PACKED_SUFFIXES))
    return next((folder / each for each in candidates if exists(folder / each)), None)


def recordings_below(path: Path) -> list[Path]:
    """Return the recordings of a directory tree; a recording itself gives itself.

    A directory with `metadata.yaml`, or with the parts of one recording (their recorder was
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
    bags = _bags_in(folder)
    if (folder / _METADATA).exists() or _named_after(folder, bags):
        return [folder]
    folders = [entry for entry in entries if entry.is_dir()]
    alone = all(entry.name == _CONFIGURATION for entry in folders)
    if alone and len(bags) > 1 and _are_parts(folder, bags):
        return [folder]
    if len(bags) == 1 and [each.name for each in folders] == [_CONFIGURATION]:
        return [folder]
    for entry in folders:
        if not entry.name.endswith(PARTIAL):
            bags += _below(entry)
    return bags


def _named_after(folder: Path, bags: list[Path]) -> bool:
    """Whether all files, of at least one, bear the folder's name and a number."""
    named = re.compile(rf"{re.escape(folder.resolve().name)}_\d+\.")
    return bool(bags) and all(named.match(bag.name) for bag in bags)
