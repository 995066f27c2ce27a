"""Where recordings are: files and folders of this machine, or addresses that fsspec opens."""

from __future__ import annotations

import glob
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..bags import recordings_below
from ..bags.bag_files import is_bag_name
from ..disk.reading import exists
from ..errors import ConfigurationError, RecordingError

_ADDRESS = re.compile(r"^[a-z][a-z0-9+.-]+(://|::)", re.IGNORECASE)
_PATTERN = re.compile(r"[*?\[]")


def is_address(place: str) -> bool:
    """Return whether a place is an address such as `s3://bucket/drive`, not a path."""
    return _ADDRESS.match(place) is not None


def recordings_at(places: Iterable[str | Path]) -> list[str]:
    """Return the recordings at paths, patterns and addresses, in their order.

    A folder stands for all recordings below it, a pattern with `*`, `**`, `?` or `[...]` for what
    matches it. What is no folder and no pattern stands for itself, whether it is there or not.

    Raises:
        ConfigurationError: nothing matches a pattern, or an address cannot be opened.
    """
    return [recording for place in places for recording in _expanded(str(place))]


def _expanded(place: str) -> Iterator[str]:
    if is_address(place):
        yield from _at_address(place)
    elif _PATTERN.search(place) and not exists(Path(place)):
        matches = sorted(glob.glob(place, recursive=True))
        found = [each for match in matches for each in _below(match, quiet=True)]
        if not found:
            raise ConfigurationError(f"{place}: no recording matches")
        yield from dict.fromkeys(found)
    else:
        yield from _below(place)


def _below(place: str, quiet: bool = False) -> list[str]:
    """Return the recordings below a path; the path itself, or nothing, where there is none."""
    path = Path(place)
    try:
        if not path.is_dir():
            return [] if quiet and not is_bag_name(path.name) else [place]
        found = recordings_below(path)
    except (OSError, RecordingError):
        return [] if quiet else [place]
    if len(found) == 1 and found[0].parent == path:  # its configuration lies beside it
        return [place]
    return [place if each == path else str(each) for each in found]


def _at_address(address: str) -> list[str]:
    """Return the recordings at an address; a folder with `metadata.yaml` is one recording."""
    files, path = _opened(address)
    try:
        if _PATTERN.search(path):
            roots = sorted(files.glob(path))
            if not roots:
                raise ConfigurationError(f"{address}: no recording matches")
        else:
            roots = [path]
        found = [each for root in roots for each in _below_remote(files, root)]
    except OSError as error:
        raise ConfigurationError(f"{address}: cannot be listed: {error}") from None
    return [_full(files, each, address) for each in found] or [address]


def _full(files: Any, path: str, address: str) -> str:
    chain = address.partition("::")[1:] if "::" in address else ("", "")
    return str(files.unstrip_protocol(path)) + "".join(chain)


def _below_remote(files: Any, root: str) -> list[str]:
    if not files.isdir(root):
        return [root]
    entries = sorted(files.ls(root, detail=True), key=lambda each: str(each["name"]))
    names = [each["name"].rstrip("/") for each in entries]
    if any(name.endswith("/metadata.yaml") for name in names):
        return [root]
    found = [name for name in names if is_bag_name(name)]
    for entry in entries:
        if entry["type"] == "directory":
            found += _below_remote(files, str(entry["name"]))
    return found


def _opened(address: str) -> tuple[Any, str]:
    """Return the file system of an address and the path in it.

    Raises:
        ConfigurationError: fsspec, or its package for such an address, is not installed.
    """
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise ConfigurationError(f"{address}: needs fsspec: pip install fsspec") from None
    try:
        files, path = url_to_fs(address)
    except (ImportError, ValueError, OSError) as error:
        raise ConfigurationError(f"{address}: cannot be opened: {error}") from None
    return files, str(path)


@contextmanager
def local_copy(place: str) -> Iterator[Path]:
    """Give the path of a recording; one at an address is copied to this machine for a while.

    Raises:
        RecordingError: it cannot be fetched.
    """
    if not is_address(place):
        yield Path(place)
        return
    files, path = _opened(place)
    with TemporaryDirectory(prefix="twbr-") as folder:
        target = Path(folder, Path(path.rstrip("/")).name)
        try:
            files.get(path, str(target), recursive=files.isdir(path))
        except Exception as error:  # each of its packages raises its own
            raise RecordingError(f"{place}: cannot be fetched: {error}") from None
        yield target
