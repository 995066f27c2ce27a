"""Read MCAP files chunk by chunk, also truncated and damaged ones.

Schemas and channels are parsed with the `mcap` package. No message depends on the summary at
the end of the file, which a recorder that was killed did not write. Checksums are checked where
there are any: a chunk whose own is wrong is left out and counted; where that of the whole data
section is wrong, this is reported.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from ..errors import RecordingError
from .mcap_checksums import data_checksum
from .mcap_chunk import RECORD_HEAD, RecordStarts, messages_in
from .mcap_records import MAGIC, Summary, outer_records, read_summary
from .message_batch import MessageBatch
from .topics import absolute, full_type
from .unpacking import CHUNK_LIMIT, COMPRESSIONS, DAMAGED, Allowance, DamagedError, unpacked

_CHUNK_HEAD = struct.Struct("<16xQII")
"""Plain size, its checksum, and the length of the compression's name; after two times."""
_LONGEST_NAME = 16


class McapStorage:
    """One MCAP file; see `Storage`."""

    def __init__(self, path: Path, allowance: Allowance) -> None:
        self.path, self._allowance = path, allowance
        self.types: dict[str, str] = {}
        self.encodings: dict[str, str] = {}
        self.repairs: Counter[str] = Counter()
        self._schemas: dict[int, str] = {}
        self._topics: dict[int, str] = {}
        self._summary: Summary | None = None
        self._counts: Counter[int] = Counter()

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield the wanted topics' messages, chunk by chunk, in file order."""
        data = np.memmap(self.path, dtype=np.uint8, mode="r")
        if data[: len(MAGIC)].tobytes() != MAGIC:
            raise RecordingError(f"{self.path}: not an MCAP file")
        self._read_summary(data)
        loose = RecordStarts()
        chunk: tuple[int, int] | None = None
        index: list[memoryview] = []
        places = self._summary.chunks if self._summary else []
        for opcode, start, stop in outer_records(data, self.repairs, len(MAGIC), places):
            if opcode == Opcode.MESSAGE_INDEX:
                index.append(data[start:stop].data)
                continue
            if chunk is not None:
                yield from self._chunk_batches(data, chunk, index, wanted)
            chunk, index = ((start, stop), []) if opcode == Opcode.CHUNK else (None, [])
            self._outer_record(data, opcode, start, stop, loose)
            if opcode == Opcode.DATA_END and wanted:
                self._check_data(data, start, stop)
        if chunk is not None:
            yield from self._chunk_batches(data, chunk, index, wanted)
        yield from self._by_topic(data, loose, wanted)
        self._check_counts(wanted)

    def _read_summary(self, data: NDArray[np.uint8]) -> None:
        """Define all channels beforehand, where the file was closed properly."""
        self._counts.clear()
        self._summary = read_summary(data)
        for opcode, content in self._summary.definitions if self._summary else ():
            self._define(opcode, content)

    def _check_data(self, data: NDArray[np.uint8], start: int, stop: int) -> None:
        if stop - start < 4:
            return
        (checksum,) = struct.unpack_from("<I", data.data, start)
        if checksum and data_checksum(data, start - RECORD_HEAD) != checksum:
            self.repairs["wrong checksum of the file: some of it is damaged"] += 1

    def _check_counts(self, wanted: frozenset[str]) -> None:
        """Compare what was found with the number of messages that the file itself gives."""
        counts = self._summary.counts if self._summary else None
        for identifier, number in (counts or {}).items():
            topic = self._topics.get(identifier)
            if topic in wanted and number != self._counts[identifier]:
                difference = number - self._counts[identifier]
                what = "missing" if difference > 0 else "too many"
                self.repairs[f"{topic}: messages {what} against the file's count"] += abs(
                    difference
                )

    def _is_wanted(self, index: list[memoryview], wanted: frozenset[str]) -> bool:
        """Return whether a chunk may hold wanted messages, or channels that are not known yet."""
        if self._summary is None or not self._topics or not index:
            return True
        channels = {int.from_bytes(content[:2], "little") for content in index}
        return any(self._topics.get(identifier) in {None, *wanted} for identifier in channels)

    def _outer_record(
        self, data: NDArray[np.uint8], opcode: int, start: int, stop: int, loose: RecordStarts
    ) -> None:
        if opcode == Opcode.MESSAGE:
            loose.add(data, start - RECORD_HEAD, stop)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._define(opcode, data[start:stop].tobytes())

    def _define(self, opcode: int, content: bytes) -> None:
        stream = ReadDataStream(BytesIO(content))
        try:
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self._schemas[schema.id] = full_type(schema.name)
            else:
                channel = Channel.read(stream)
                topic = absolute(channel.topic)
                self._topics[channel.id] = topic
                self.types[topic] = self._schemas.get(channel.schema_id, "unknown type")
                self.encodings[topic] = channel.message_encoding
        except (McapError, struct.error, ValueError, OverflowError, MemoryError):
            self.repairs["damaged schema or channel record skipped"] += 1

    def _chunk_batches(
        self,
        data: NDArray[np.uint8],
        place: tuple[int, int],
        index: list[memoryview],
        wanted: frozenset[str],
    ) -> Iterator[tuple[str, MessageBatch]]:
        if not self._is_wanted(index, wanted):
            return
        try:
            plain = self._decompressed(data[place[0] : place[1]].data, place[1] == data.size)
        except DamagedError as error:
            self.repairs[str(error)] += 1
            return
        inside = np.frombuffer(plain, dtype=np.uint8)
        found = messages_in(inside, index, self._define)
        if found.ends_early and place[1] < data.size:
            self.repairs["damaged records inside a chunk; read up to there"] += 1
        yield from self._by_topic(inside, found, wanted)

    def _decompressed(self, record: memoryview, at_end: bool) -> bytes:
        """Return a chunk's records.

        Raises:
            DamagedError: its lengths, checksum or content are wrong.
        """
        try:
            size, checksum, length = _CHUNK_HEAD.unpack_from(record)
            (announced,) = struct.unpack_from("<Q", record, _CHUNK_HEAD.size + length)
            name = bytes(record[_CHUNK_HEAD.size :][: min(length, _LONGEST_NAME)]).decode()
        except (struct.error, UnicodeDecodeError, OverflowError) as error:
            raise DamagedError(DAMAGED) from error
        content = record[_CHUNK_HEAD.size + length + 8 :]
        if len(content) > announced or (len(content) < announced and not at_end):
            raise DamagedError(DAMAGED)
        if name not in COMPRESSIONS:
            raise DamagedError(f"chunk of unknown compression {name!r} skipped")
        if name and size > CHUNK_LIMIT:
            raise DamagedError(f"chunk of more than {CHUNK_LIMIT >> 20} MiB skipped")
        if name:
            self._allowance.take(size)
        whole = len(content) == announced
        plain = unpacked(name, bytes(content), size, whole)
        if whole and checksum and zlib.crc32(plain) != checksum:
            raise DamagedError("chunk with wrong checksum skipped")
        return plain

    def _by_topic(
        self, data: NDArray[np.uint8], found: RecordStarts, wanted: frozenset[str]
    ) -> Iterator[tuple[str, MessageBatch]]:
        channels, batch = found.batch(data)
        for identifier in np.flatnonzero(np.bincount(channels)).tolist():
            topic = self._topics.get(identifier)
            chosen = channels == identifier
            if topic is None:
                number = int(np.count_nonzero(chosen))
                self.repairs["messages of an undefined channel skipped"] += number
            elif topic in wanted:
                if self.encodings[topic] != "cdr":
                    raise RecordingError(
                        f"{self.path}: {topic} is encoded as "
                        f"{self.encodings[topic]!r}; only 'cdr' can be read"
                    )
                self._counts[identifier] += int(np.count_nonzero(chosen))
                yield topic, batch.take(chosen)
