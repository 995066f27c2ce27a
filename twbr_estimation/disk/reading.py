"""Open files to read: regular ones only, within a limit of size."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from ..errors import TwbrError
from .faults import megabytes, reason_of

_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}


def open_regular(path: Path, error: type[TwbrError]) -> BinaryIO:
    """Open a file; pipes and devices, whose reading may never end, are refused at once.

    Args:
        path: file to read.
        error: what is raised where it cannot be read.

    Raises:
        TwbrError: as `error` says; the message names the file and the reason.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            kind = stat.S_IFMT(os.fstat(descriptor).st_mode)
            if kind != stat.S_IFREG:
                raise error(f"{path}: cannot be read: it is {_KINDS.get(kind, 'no file')}")
            return os.fdopen(descriptor, "rb")
        except BaseException:
            os.close(descriptor)
            raise
    except OSError as problem:
        raise error(f"{path}: cannot be read: {reason_of(problem)}") from None


def read_bytes(path: Path, limit: int, error: type[TwbrError]) -> bytes:
    """Return the content of a file of at most `limit` bytes.

    Raises:
        TwbrError: as `error` says: the file cannot be read, or is larger.
    """
    with open_regular(path, error) as file:
        try:
            content = file.read(limit + 1)
        except OSError as problem:
            raise error(f"{path}: cannot be read: {reason_of(problem)}") from None
    if len(content) > limit:
        raise error(f"{path}: is larger than {megabytes(limit)}, the limit for such a file")
    return content


def read_text(path: Path, limit: int, error: type[TwbrError]) -> str:
    """Return the content of a UTF-8 file of at most `limit` bytes.

    Raises:
        TwbrError: as `error` says: the file cannot be read, is larger, or is no UTF-8.
    """
    content = read_bytes(path, limit, error)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = content.count(b"\n", 0, problem.start) + 1
        raise error(f"{path}: cannot be read: line {line} is not UTF-8 text") from None


def exists(path: Path) -> bool:
    """Return whether `path` exists; a path that may not be read counts as absent."""
    try:
        return path.exists()
    except OSError:
        return False


def is_folder(path: Path) -> bool:
    """Return whether `path` is a folder; a path that may not be read counts as none."""
    try:
        return path.is_dir()
    except OSError:
        return False


def readable(path: Path) -> str:
    """Return a path for tables and pictures; bytes that are no text become escapes."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")
