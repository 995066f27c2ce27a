"""Read rosbag2's sqlite3 storage."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from .batch import MessageBatch, joined

MAGIC = b"SQLite format 3\x00"
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
        query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id"
        try:
            cursor = database.execute(query, (identifier,))
            while rows := cursor.fetchmany(_ROWS):
                times, blobs = zip(*rows, strict=True)
                yield topic, joined(blobs, np.array(times, dtype=np.int64))
        except sqlite3.Error:
            self.repairs[f"{topic}: database is damaged; read up to there"] += 1
