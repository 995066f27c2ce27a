"""Files under temporary names: how they are flushed, found and removed."""

from __future__ import annotations

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path

from .locks import locked

PARTIAL = ".partial"
ASIDE = ".old"
"""Ending of the old folder inside a holder while the new one takes its place."""


def token() -> str:
    """Return a part of a name that no other writer has."""
    return os.urandom(4).hex()


def synchronised(path: Path, everything: bool = False) -> None:
    """Flush a file or folder to the disk; with `everything` also what the folder holds.

    Raises:
        OSError: the disk is full, or fails.
    """
    if everything:
        for folder, _, names in os.walk(path):
            for name in names:
                synchronised(Path(folder, name))
            synchronised(Path(folder))
        return
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except PermissionError:  # a folder that may be written but not listed
        return
    try:
        os.fsync(descriptor)
    except OSError as error:
        if path.is_file() or error.errno not in _NO_FOLDER_SYNC:
            raise
    finally:
        os.close(descriptor)


_NO_FOLDER_SYNC = (22, 95)  # EINVAL, EOPNOTSUPP: file systems that cannot flush a folder


def clean_up(target: Path) -> None:
    """Remove what killed writers of `target` left; restore a folder that they had moved."""
    for leftover in leftovers(target):
        if leftover.is_dir():
            lock = locked(leftover)
            if lock is None:
                continue
            _bring_back(leftover, target)
            discard(leftover)
            os.close(lock)
            continue
        lock = locked(leftover)
        if lock is not None:
            leftover.unlink(missing_ok=True)
            os.close(lock)


def leftovers(target: Path) -> list[Path]:
    """Return the temporary files of writers of `target`, running or killed."""
    prefix = f".{target.name}."
    try:
        names = os.listdir(target.parent)
    except OSError:
        return []
    known = len(prefix) + len(token()) + len(PARTIAL)
    return [
        target.with_name(name)
        for name in names
        if name.startswith(prefix) and name.endswith(PARTIAL) and len(name) == known
    ]


def abandoned(folder: Path, kind: str) -> list[tuple[Path, int]]:
    """Return temporary folders, of whatever target, whose writers were killed.

    Args:
        folder: Where to look.
        kind: Ending of their targets' names.

    Returns:
        Each with a descriptor that holds its lock; the caller closes it.

    Raises:
        OSError: the folder cannot be listed.
    """
    form = re.compile(rf"\..+{re.escape(kind)}\.[0-9a-f]{{{len(token())}}}{re.escape(PARTIAL)}")
    paths = [folder / name for name in sorted(os.listdir(folder)) if form.fullmatch(name)]
    found = [(path, locked(path)) for path in paths if path.is_dir()]
    return [(path, lock) for path, lock in found if lock is not None]


def restore(target: Path) -> None:
    """Bring back a folder that a killed writer had put aside, where `target` is missing."""
    if os.path.lexists(target):
        return
    for leftover in leftovers(target):
        lock = locked(leftover)
        if lock is not None:
            with suppress(OSError):
                _bring_back(leftover, target)
            os.close(lock)


def _bring_back(holder: Path, target: Path) -> None:
    aside = holder / f"{target.name}{ASIDE}"
    if aside.exists() and not os.path.lexists(target):
        os.rename(aside, target)


def discard(holder: Path) -> None:
    """Delete a folder; errors are ignored."""
    shutil.rmtree(holder, ignore_errors=True)
