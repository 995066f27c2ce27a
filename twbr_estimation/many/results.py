"""Results as JSON lines in one file that only grows: a row for each part of each recording.

A row has a key, which stands for all that the result follows from. What was cut off while it was
written, by a killed process or a full disk, is a last line without an end and is dropped by the
next writer; several writers may append to one file.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ..disk.faults import writing_error
from ..errors import WritingError

Row = Mapping[str, Any]
LARGEST_CACHE = 1 << 26
"""Size at which the table in the user's cache is begun again [bytes]."""


class ResultTable:
    """The rows of a file by key; only where they stand is in memory."""

    def __init__(self, path: Path) -> None:
        """Open or create the table at `path`.

        Raises:
            WritingError: it cannot be written.
        """
        self.path = path
        self._places: dict[str, tuple[int, int]] = {}
        self._read_to = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK
            self._file = os.open(path, flags, 0o666)
            if not stat.S_ISREG(os.fstat(self._file).st_mode):
                raise OSError(errno.EINVAL, "it is no file")
            with self._held():
                self._drop_torn_line()
                self._index()
        except OSError as error:
            raise writing_error(path, error, 0) from None

    @staticmethod
    def of_user() -> ResultTable:
        """Open the table in the user's cache, which holds what is asked for again."""
        home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
        path = Path(home, "twbr_estimation", "results.jsonl")
        with suppress(OSError):
            if path.stat().st_size > LARGEST_CACHE:
                path.unlink()
        return ResultTable(path)

    def __contains__(self, key: str) -> bool:
        """Return whether there is a row of this key."""
        return key in self._places

    def __len__(self) -> int:
        """Return how many keys there are."""
        return len(self._places)

    def row(self, key: str) -> Row:
        """Return the latest row of a key.

        Raises:
            KeyError: there is none.
        """
        place, size = self._places[key]
        row: Row = json.loads(os.pread(self._file, size, place))
        return row

    def append(self, rows: Iterable[Row]) -> None:
        """Append rows, all or none of them.

        Raises:
            WritingError: the disk is full, or fails.
        """
        text = "".join(json.dumps(row, separators=(",", ":")) + "\n" for row in rows).encode()
        if not text:
            return
        with self._held():
            end = os.lseek(self._file, 0, os.SEEK_END)
            try:
                if os.write(self._file, text) != len(text):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os.fdatasync(self._file)
            except OSError as error:
                with suppress(OSError):
                    os.ftruncate(self._file, end)
                raise writing_error(self.path, error, len(text)) from None
            self._index()

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    @contextmanager
    def _held(self) -> Iterator[None]:
        """Hold the file against other writers; file systems without locks go without."""
        with suppress(OSError):
            fcntl.flock(self._file, fcntl.LOCK_EX)
        try:
            yield
        finally:
            with suppress(OSError):
                fcntl.flock(self._file, fcntl.LOCK_UN)

    def _drop_torn_line(self) -> None:
        """Cut off a last line that its writer did not finish."""
        end = os.lseek(self._file, 0, os.SEEK_END)
        step, place = 1 << 16, end
        while place > 0:
            begin = max(0, place - step)
            newline = os.pread(self._file, place - begin, begin).rfind(b"\n")
            if newline >= 0:
                place = begin + newline + 1
                break
            place = begin
        if place < end:
            os.ftruncate(self._file, place)

    def _index(self) -> None:
        """Note where rows stand that were appended since, by this process or another."""
        with os.fdopen(os.dup(self._file), "rb") as file:
            file.seek(self._read_to)
            for line in file:
                if not line.endswith(b"\n"):
                    break
                if key := _key_of(line):
                    self._places[key] = self._read_to, len(line)
                self._read_to += len(line)


def _key_of(line: bytes) -> str:
    """Return the key of a row; nothing for another line, or one without a result."""
    try:
        row = json.loads(line)
    except (ValueError, RecursionError):
        return ""
    return str(row.get("key") or "") if isinstance(row, dict) else ""


def open_table(path: Path | None) -> ResultTable:
    """Open the table at `path`; that of the user without one, if it can be written.

    Raises:
        WritingError: it cannot be written.
    """
    if path is not None:
        return ResultTable(path)
    try:
        return ResultTable.of_user()
    except (WritingError, RuntimeError):  # no home, or one that cannot be written
        from tempfile import mkdtemp

        return ResultTable(Path(mkdtemp(prefix="twbr-"), "results.jsonl"))
