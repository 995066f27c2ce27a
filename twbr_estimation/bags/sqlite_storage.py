"""Read rosbag2's sqlite3 storage."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from .message_batch import MessageBatch, joined

MAGIC = b"SQLite format 3\x00"
_QUERY = "SELECT id, timestamp, data FROM messages WHERE topic_id = ? AND id > ? ORDER BY id"
_ROWS = 16384
"""Messages fetched at once."""


class SqliteStorage:
    """One .db3 file; see `Storage`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.types: dict[str, str] = {}
        self.repairs: Counter[str] = Counter()

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield the wanted topics' messages in the order they were written."""
        with closing(self._connect()) as database:
            try:
                topics = database.execute(
                    "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
                ).fetchall()
            except sqlite3.Error as error:
                raise RecordingError(f"{self.path}: not a rosbag2 database: {error}") from error
            self.types = {name: kind for _, name, kind, _ in topics}
            for identifier, name, _, encoding in topics:
                if name in wanted:
                    self._require_cdr(name, encoding)
                    yield from self._messages(database, identifier, name)

    def _connect(self) -> sqlite3.Connection:
        write_ahead = self.path.with_name(self.path.name + "-wal").exists()
        mode = "mode=ro" if write_ahead else "mode=ro&immutable=1"
        return sqlite3.connect(f"{self.path.resolve().as_uri()}?{mode}", uri=True)

    def _require_cdr(self, topic: str, encoding: str) -> None:
        if encoding != "cdr":
            raise RecordingError(
                f"{self.path}: {topic} is encoded as {encoding!r}; only 'cdr' can be read"
            )

    def _messages(
        self, database: sqlite3.Connection, identifier: int, topic: str
    ) -> Iterator[tuple[str, MessageBatch]]:
        """Yield one topic's messages; of a damaged database those before the damage."""
        last = -1
        try:
            cursor = database.execute(_QUERY, (identifier, last))
            while rows := cursor.fetchmany(_ROWS):
                last = rows[-1][0]
                yield topic, _batch(rows)
        except sqlite3.Error:
            self.repairs[f"{topic}: database is damaged; read up to there"] += 1
            if rows := _up_to_the_damage(database, identifier, last):
                yield topic, _batch(rows)


def _up_to_the_damage(
    database: sqlite3.Connection, identifier: int, last: int
) -> list[tuple[int, int, bytes]]:
    """Return the rows after `last` one by one: a failed `fetchmany` keeps none of its rows."""
    rows = []
    try:
        for row in database.execute(_QUERY, (identifier, last)):
            rows.append(row)
    except sqlite3.Error:
        pass
    return rows


def _batch(rows: list[tuple[int, int, bytes]]) -> MessageBatch:
    _, times, messages = zip(*rows, strict=True)
    return joined(messages, np.array(times, dtype=np.int64))
