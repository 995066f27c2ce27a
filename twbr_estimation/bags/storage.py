"""What every kind of bag file offers to the reader, and how files are found and told apart."""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import yaml
import zstandard

from ..errors import RecordingError
from .mcap_storage import MAGIC as MCAP_MAGIC
from .mcap_storage import McapStorage
from .message_batch import MessageBatch
from .ros1_storage import MAGIC as ROS1_MAGIC
from .ros1_storage import Ros1Storage
from .sqlite_storage import MAGIC as SQLITE_MAGIC
from .sqlite_storage import SqliteStorage

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_SUFFIXES = (".mcap", ".db3", ".bag", ".mcap.zstd", ".db3.zstd")


class Storage(Protocol):
    """One file of recorded messages."""

    types: dict[str, str]
    """Message type by topic; complete after `batches` has been read to its end."""
    repairs: Counter[str]
    """What could not be read, counted."""

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield topic and messages of the wanted topics.

        Raises:
            RecordingError: the file is not what its first bytes promise.
        """
        ...


_KINDS: dict[bytes, type[Any]] = {
    MCAP_MAGIC: McapStorage,
    SQLITE_MAGIC: SqliteStorage,
    ROS1_MAGIC: Ros1Storage,
}


@contextmanager
def opened(path: Path) -> Iterator[Storage]:
    """Open one bag file by its first bytes; one compressed as a whole is unpacked for a while.

    Raises:
        RecordingError: missing, empty, or no bag.
    """
    try:
        with path.open("rb") as file:
            head = file.read(16)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from error
    if head.startswith(_ZSTD_MAGIC):
        with tempfile.TemporaryDirectory() as folder:
            yield _storage(_unpacked(path, Path(folder)))
        return
    yield _storage(path, head)


def _storage(path: Path, head: bytes | None = None) -> Storage:
    if head is None:
        with path.open("rb") as file:
            head = file.read(16)
    if not head:
        raise RecordingError(f"{path}: the file is empty")
    for magic, kind in _KINDS.items():
        if head.startswith(magic):
            storage: Storage = kind(path)
            return storage
    raise RecordingError(f"{path}: not a recording; an .mcap, .db3 or ROS 1 .bag file is needed")


def _unpacked(path: Path, folder: Path) -> Path:
    target = folder / path.stem
    try:
        with path.open("rb") as packed, target.open("wb") as plain:
            zstandard.ZstdDecompressor().copy_stream(packed, plain)
    except zstandard.ZstdError as error:
        raise RecordingError(f"{path}: cannot be decompressed: {error}") from error
    return target


def bag_files(path: Path) -> list[Path]:
    """Return the files of a recording: of a rosbag2 directory all, else the file itself.

    A directory without `metadata.yaml` (the recorder was killed) counts with the bag files
    that lie in it.

    Raises:
        RecordingError: nothing there, or files that the metadata lists are missing.
    """
    if not path.exists():
        raise RecordingError(f"{path}: there is no such recording")
    if not path.is_dir():
        return [path]
    metadata = path / "metadata.yaml"
    if metadata.exists():
        files = [path / Path(name).name for name in _listed(metadata)]
    else:
        files = sorted(file for file in path.iterdir() if file.name.endswith(_SUFFIXES))
    if not files:
        raise RecordingError(f"{path}: the directory holds no recording")
    if missing := [file.name for file in files if not file.exists()]:
        raise RecordingError(f"{path}: metadata.yaml lists missing files: {', '.join(missing)}")
    return files


def _listed(metadata: Path) -> list[str]:
    try:
        content = yaml.safe_load(metadata.read_text(encoding="utf-8"))
        return [str(name) for name in content["rosbag2_bagfile_information"]["relative_file_paths"]]
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError) as error:
        raise RecordingError(f"{metadata}: not the metadata of a rosbag2: {error}") from error


def recordings_below(path: Path) -> list[Path]:
    """Return the recordings of a directory tree; a recording itself gives itself.

    A directory with `metadata.yaml`, or with files that bear its own name (their recorder was
    killed), is one recording. In another one every bag file is a recording of its own.

    Raises:
        RecordingError: nothing there, or no recording below it.
    """
    if not path.exists():
        raise RecordingError(f"{path}: there is no such recording")
    if not path.is_dir():
        return [path]
    found = _below(path)
    if not found:
        raise RecordingError(f"{path}: there is no recording in this directory")
    return found


def _below(folder: Path) -> list[Path]:
    entries = sorted(folder.iterdir())
    bags = [entry for entry in entries if entry.name.endswith(_SUFFIXES)]
    if (folder / "metadata.yaml").exists() or any(_named_after(folder, bag) for bag in bags):
        return [folder]
    for entry in entries:
        if entry.is_dir():
            bags += _below(entry)
    return bags


def _named_after(folder: Path, bag: Path) -> bool:
    return re.match(rf"{re.escape(folder.resolve().name)}_\d+\.", bag.name) is not None
