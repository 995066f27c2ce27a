"""Put a folder into the place of another."""

from __future__ import annotations

import ctypes
import errno
import os
from pathlib import Path

from .partials import ASIDE

_AT_WORKING_FOLDER = -100
_EXCHANGE = 2
_NOT_SUPPORTED = (errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP)


def put_in_place(new: Path, target: Path) -> None:
    """Move a folder to `target`; what was there ends up beside where `new` was.

    Linux exchanges the two in one step. On file systems that cannot, the old folder is put
    aside first; `partials.restore` brings it back where a process died between the two steps.

    Raises:
        OSError: it cannot be moved; what was at `target` is still there.
    """
    if not os.path.lexists(target):
        os.rename(new, target)
        return
    try:
        exchange(new, target)
    except OSError as error:
        if error.errno not in _NOT_SUPPORTED:
            raise
        move_in_two_steps(new, target)


def exchange(first: Path, second: Path) -> None:
    """Exchange two folders in one step.

    Raises:
        OSError: also where the file system or the system's library cannot.
    """
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))
    paths = os.fsencode(first), os.fsencode(second)
    if rename(_AT_WORKING_FOLDER, paths[0], _AT_WORKING_FOLDER, paths[1], _EXCHANGE):
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(second))


def move_in_two_steps(new: Path, target: Path) -> None:
    """Put the old folder aside, then the new one in its place.

    Raises:
        OSError: it cannot be moved; the old folder is back.
    """
    aside = new.with_name(f"{target.name}{ASIDE}")
    os.rename(target, aside)
    try:
        os.rename(new, target)
    except OSError:
        os.rename(aside, target)
        raise
