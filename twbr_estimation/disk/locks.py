"""Locks on files and folders; the kernel releases them when their process ends."""

from __future__ import annotations

import errno
import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_TIMEOUT = 30.0
"""How long to wait for another writer's short hold of a folder [s]."""
_PAUSE = 0.01
_BUSY = (errno.EAGAIN, errno.EACCES)


def own(descriptor: int) -> None:
    """Mark an open file as that of a running process, where the file system has locks."""
    with suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def locked(path: Path) -> int | None:
    """Return a descriptor that holds the lock of `path`; None where a running process has it."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # held, or a file system without locks, where it cannot be found out
        os.close(descriptor)
        return None
    return descriptor


@contextmanager
def directory_locked(folder: Path) -> Iterator[None]:
    """Hold a folder against other writers for a moment.

    Where the folder may not be listed or its file system has no locks, nothing is held: each
    writer's temporary names are its own, and the last one to finish wins.

    Raises:
        TimeoutError: another process holds it for longer than half a minute.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except PermissionError:
        yield
        return
    try:
        _wait(descriptor, folder)
        yield
    finally:
        os.close(descriptor)


def _wait(descriptor: int, folder: Path) -> None:
    end = time.monotonic() + _TIMEOUT
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except OSError as error:
            if error.errno not in _BUSY:
                return
        if time.monotonic() > end:
            raise TimeoutError(
                errno.ETIMEDOUT, f"another process has held the folder for {_TIMEOUT:g} s", folder
            )
        time.sleep(_PAUSE)
