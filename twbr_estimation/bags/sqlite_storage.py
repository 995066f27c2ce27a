"""Read rosbag2's sqlite3 storage."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.faults import reason_of
from ..errors import RecordingError
from .message_batch import MessageBatch, joined
from .topics import absolute, full_type
from .unpacking import MESSAGE_LIMIT, Allowance

_PAGE_SIZE, _PAGES, _LARGEST_PAGE = slice(16, 18), slice(28, 32), 65536
"""Where the header of a database has the size of a page, 1 for the largest, and their number."""
_QUERY = f"""SELECT id, timestamp,
    CASE WHEN typeof(timestamp) = 'integer' AND typeof(data) = 'blob'
        AND length(data) <= {MESSAGE_LIMIT} THEN data END
    FROM messages WHERE topic_id = ? AND id > ? ORDER BY id"""
_TABLES = "SELECT name, type, sql FROM sqlite_master WHERE name IN ('topics', 'messages')"
_ROWS = 16384
"""Most messages fetched at once."""
_BYTES = 1 << 24
"""About how many bytes are fetched at once."""
_STEPS = 100_000
"""Steps of the database's machine between two looks at how many there were."""
_STEPS_PER_BYTE = 20
_FREE_STEPS = 20_000_000

Row = tuple[int, int, bytes | None]


class SqliteStorage:
    """One .db3 file; see `Storage`."""

    def __init__(self, path: Path, allowance: Allowance) -> None:
        del allowance  # a database is not compressed
        self.path = path
        self.types: dict[str, str] = {}
        self.encodings: dict[str, str] = {}
        self.repairs: Counter[str] = Counter()

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield the wanted topics' messages in the order they were written."""
        with self._opened() as database:
            for identifier, topic, kind, encoding in self._topics(database):
                self.types[topic], self.encodings[topic] = full_type(kind), encoding
                if topic in wanted:
                    self._require_cdr(topic, encoding)
                    yield from self._messages(database, identifier, topic)

    @contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        """Open the database; one that a recorder left open, on a read-only medium, as a copy."""
        logs = [self.path.with_name(self.path.name + "-wal")]
        if not logs[0].exists() and self._is_cut_off():
            with tempfile.TemporaryDirectory() as folder:
                path = self._as_long_as_it_is(Path(folder))
                with self._connected(path, "mode=ro&immutable=1") as database:
                    yield database
            return
        if not logs[0].exists():
            with self._connected(self.path, "mode=ro&immutable=1") as database:
                yield database
            return
        try:
            with self._connected(self.path, "mode=ro") as database:
                database.execute("SELECT count(*) FROM sqlite_master").fetchone()
                yield database
            return
        except sqlite3.OperationalError:
            pass
        with tempfile.TemporaryDirectory() as folder:
            mode, path = self._copied([self.path, *logs], Path(folder))
            with self._connected(path, mode) as database:
                yield database

    def _is_cut_off(self) -> bool:
        """Whether the file is shorter than its header says; SQLite refuses such a file."""
        with self.path.open("rb") as file:
            header = file.read(_PAGES.stop)
        size = int.from_bytes(header[_PAGE_SIZE], "big")
        pages = int.from_bytes(header[_PAGES], "big")
        return self.path.stat().st_size < pages * (_LARGEST_PAGE if size == 1 else size)

    def _as_long_as_it_is(self, folder: Path) -> Path:
        """Return a copy of a file that was cut off whose header gives no length.

        Raises:
            RecordingError: there is no room for it.
        """
        path = folder / self.path.name
        try:
            shutil.copyfile(self.path, path)
            with path.open("r+b") as file:
                file.seek(_PAGES.start)
                file.write(bytes(_PAGES.stop - _PAGES.start))
        except OSError as error:
            text = f"the file is cut off, and there is no room for a copy: {reason_of(error)}"
            raise RecordingError(f"{self.path}: {text}") from error
        self.repairs["file is cut off; read up to there; .recover of sqlite3 may find more"] = 1
        return path

    def _copied(self, files: list[Path], folder: Path) -> tuple[str, Path]:
        """Return how and where to open a copy; without room for one the file without its log."""
        try:
            for file in files:
                shutil.copyfile(file, folder / file.name)
        except OSError as error:
            self.repairs[
                f"{files[1].name} left out, as it cannot be copied: {reason_of(error)}"
            ] = 1
            return "mode=ro&immutable=1", self.path
        return "mode=ro", folder / self.path.name

    @contextmanager
    def _connected(self, path: Path, mode: str) -> Iterator[sqlite3.Connection]:
        database = sqlite3.connect(f"{path.resolve().as_uri()}?{mode}", uri=True)
        steps = _Steps(_FREE_STEPS + _STEPS_PER_BYTE * path.stat().st_size)
        database.set_progress_handler(steps, _STEPS)
        database.execute("PRAGMA trusted_schema = OFF")
        try:
            yield database
        finally:
            database.close()

    def _topics(self, database: sqlite3.Connection) -> list[tuple[int, str, str, str]]:
        try:
            for name, kind, sql in database.execute(_TABLES).fetchall():
                if kind != "table" or not str(sql).upper().startswith("CREATE TABLE"):
                    raise RecordingError(f"{self.path}: {name} is a {kind}, not a plain table")
            rows = database.execute(
                "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
            ).fetchall()
        except (sqlite3.Error, OverflowError) as error:
            raise RecordingError(f"{self.path}: not a rosbag2 database: {error}") from error
        return [row for each in rows if (row := self._topic(*each)) is not None]

    def _topic(
        self, identifier: Any, name: Any, kind: Any, encoding: Any
    ) -> tuple[int, str, str, str] | None:
        if not isinstance(identifier, int) or not isinstance(name, str):
            self.repairs["damaged topics left out"] += 1
            return None
        return identifier, absolute(name), str(kind), str(encoding)

    def _require_cdr(self, topic: str, encoding: str) -> None:
        if encoding != "cdr":
            raise RecordingError(
                f"{self.path}: {topic} is encoded as {encoding!r}; only 'cdr' can be read"
            )

    def _messages(
        self, database: sqlite3.Connection, identifier: int, topic: str
    ) -> Iterator[tuple[str, MessageBatch]]:
        """Yield one topic's messages; of a damaged database those before the damage."""
        last, amount = -1, _ROWS // 64
        try:
            cursor = database.execute(_QUERY, (identifier, last))
            while rows := cursor.fetchmany(amount):
                last = rows[-1][0]
                if (batch := self._batch(rows, topic)) is not None:
                    yield topic, batch
                    amount = max(1, min(_ROWS, _BYTES // max(int(batch.sizes.max()), 1)))
        except (sqlite3.Error, OverflowError, UnicodeDecodeError) as error:
            self.repairs[f"{topic}: database is damaged; read up to there"] += 1
            if str(error) != "interrupted" and (
                batch := self._batch(_up_to_the_damage(database, identifier, last), topic)
            ):
                yield topic, batch

    def _batch(self, rows: list[Row], topic: str) -> MessageBatch | None:
        """Return the rows that hold a message; others are counted."""
        good = [row for row in rows if row[2] is not None]
        if len(good) < len(rows):
            self.repairs[f"{topic}: damaged messages dropped"] += len(rows) - len(good)
        if not good:
            return None
        _, times, messages = zip(*good, strict=True)
        return joined(messages, np.array(times, dtype=np.int64))


class _Steps:
    """Interrupts a query that takes more steps than a table of the file's size can need."""

    def __init__(self, limit: int) -> None:
        self._left = limit

    def __call__(self) -> bool:
        self._left -= _STEPS
        return self._left < 0


def _up_to_the_damage(database: sqlite3.Connection, identifier: int, last: int) -> list[Row]:
    """Return the rows after `last` one by one: a failed `fetchmany` keeps none of its rows."""
    rows: list[Row] = []
    try:
        for row in database.execute(_QUERY, (identifier, last)):
            rows.append(row)
    except (sqlite3.Error, OverflowError, UnicodeDecodeError):
        pass
    return rows
