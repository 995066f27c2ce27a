"""What a recording holds, as a digest of its bytes: the same under another name and place."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from .. import __version__
from ..bags.bag_files import bag_files
from ..configuration.of_recording import CONFIG_FOLDER
from ..disk.reading import open_regular
from ..errors import RecordingError
from .places import is_address, local_copy

_BLOCK = 1 << 20
_SHELLS = ("cli", "nodes", "dashboard")
"""Folders of the package that take no part in any figure."""


def content_of(place: str) -> tuple[str, int]:
    """Return the digest of a recording with its own configuration, and its size [bytes].

    Raises:
        RecordingError: it cannot be read.
    """
    with local_copy(place) as path:
        files, _ = bag_files(path)
        return _digest((*files, *_configuration(path / CONFIG_FOLDER)))


def size_of(place: str) -> int:
    """Return the size of a recording on this machine [bytes]; 0 where it is not known."""
    if is_address(place):
        return 0
    try:
        return sum(file.stat().st_size for file in bag_files(Path(place))[0])
    except (OSError, RecordingError):
        return 0


def digest_of_folder(folder: Path | None) -> str:
    """Return the digest of a folder of configuration files; empty without one."""
    return "" if folder is None else _digest(_configuration(folder))[0]


def _configuration(folder: Path) -> Iterator[Path]:
    try:
        yield from sorted(path for path in folder.iterdir() if path.is_file())
    except OSError:
        return  # no such folder: reading the recording reports it


def _digest(files: Iterable[Path]) -> tuple[str, int]:
    total, size = hashlib.sha256(), 0
    for path in files:
        digest = hashlib.sha256()
        with open_regular(path, RecordingError) as file:
            while block := file.read(_BLOCK):
                digest.update(block)
                size += len(block)
        total.update(digest.digest())
        if path.parent.name == CONFIG_FOLDER or path.suffix in (".yaml", ".yml"):
            total.update(path.name.encode())
    return total.hexdigest()[:32], size


@cache
def version() -> str:
    """Return the package's version with a digest of all sources that take part in a figure."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        if path.relative_to(package).parts[0] not in _SHELLS:
            digest.update(path.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"
