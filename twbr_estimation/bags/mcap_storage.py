"""Read MCAP files chunk by chunk, also truncated and damaged ones.

The outer records are parsed with the `mcap` package. No message depends on the summary at
the end of the file, which a recorder that was killed did not write. Every chunk's checksum is
checked, where it has one; that of the whole data section is not, as it would not tell which
messages to leave out.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from numpy.typing import NDArray

from ..errors import RecordingError
from .mcap_chunk import RECORD_HEAD, Found, messages_in
from .message_batch import MessageBatch

MAGIC = b"\x89MCAP0\r\n"
_FOOTER_SIZE = 37
"""Footer record and closing magic number [bytes]."""
_CHUNK_HEAD = 40
"""Fixed part of a chunk record, without the compression's name [bytes]."""


class McapStorage:
    """One MCAP file; see `Storage`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.types: dict[str, str] = {}
        self.repairs: Counter[str] = Counter()
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}
        self._complete = False

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield the wanted topics' messages, chunk by chunk, in file order."""
        data = np.memmap(self.path, dtype=np.uint8, mode="r")
        self._read_summary(data)
        loose = Found()
        chunk: tuple[int, int] | None = None
        index: list[memoryview] = []
        for opcode, start, stop in self._outer_records(data):
            if opcode == Opcode.MESSAGE_INDEX:
                index.append(data[start:stop].data)
                continue
            if chunk is not None:
                yield from self._chunk_batches(data, chunk, index, wanted)
            chunk, index = ((start, stop), []) if opcode == Opcode.CHUNK else (None, [])
            self._outer_record(data, opcode, start, stop, loose)
        if chunk is not None:
            yield from self._chunk_batches(data, chunk, index, wanted)
        yield from self._by_topic(data, loose, wanted)

    def _read_summary(self, data: NDArray[np.uint8]) -> None:
        """Learn all channels beforehand, where the file was closed properly."""
        footer = data[-_FOOTER_SIZE:].tobytes()
        if not (footer[:1] == bytes([Opcode.FOOTER]) and footer.endswith(MAGIC)):
            return
        start, _, checksum = struct.unpack_from("<QQI", footer, RECORD_HEAD)
        if not len(MAGIC) < start < data.size:
            return
        if checksum and zlib.crc32(data[start : -len(MAGIC) - 4].tobytes()) != checksum:
            return
        for opcode, begin, end in self._outer_records(data, start):
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, data[begin:end].tobytes())
        self._complete = bool(self._channels)

    def _is_wanted(self, index: list[memoryview], wanted: frozenset[str]) -> bool:
        """Return whether a chunk may hold wanted messages, or channels that are not known yet."""
        if not self._complete or not index:
            return True
        channels = {int.from_bytes(content[:2], "little") for content in index}
        known = {identifier: channel.topic for identifier, channel in self._channels.items()}
        return any(known.get(identifier) in {None, *wanted} for identifier in channels)

    def _outer_records(
        self, data: NDArray[np.uint8], at: int = 0
    ) -> Iterator[tuple[int, int, int]]:
        """Yield opcode, start and stop of each record's content; the last may be cut off.

        `at` is where a record starts, 0 for the first.
        """
        if data[: len(MAGIC)].tobytes() != MAGIC:
            raise RecordingError(f"{self.path}: not an MCAP file")
        raw, at = data.data, at or len(MAGIC)
        while at + RECORD_HEAD <= data.size:
            opcode, length = struct.unpack_from("<BQ", raw, at)
            start, at = at + RECORD_HEAD, at + RECORD_HEAD + length
            # A file system that lost power pads with zeros, from the middle of a message on.
            padding_follows = opcode == Opcode.MESSAGE and at < data.size and raw[at] == 0
            if opcode == 0 or padding_follows:
                break
            yield opcode, start, min(at, data.size)
            if opcode == Opcode.FOOTER:
                return
        self.repairs["file is cut off; read up to there"] += 1

    def _outer_record(
        self, data: NDArray[np.uint8], opcode: int, start: int, stop: int, loose: Found
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
                self._schemas[schema.id] = schema.name
            else:
                channel = Channel.read(stream)
                self._channels[channel.id] = channel
                self.types[channel.topic] = self._schemas.get(channel.schema_id, "unknown type")
        except (McapError, struct.error, UnicodeDecodeError):
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
        plain = self._decompressed(data[place[0] : place[1]].tobytes())
        if plain is None:
            return
        inside = np.frombuffer(plain, dtype=np.uint8)
        found = messages_in(inside, index, self._define)
        yield from self._by_topic(inside, found, wanted)

    def _decompressed(self, record: bytes) -> bytes | None:
        """Return a chunk's records; None, counted, where its checksum or content is wrong."""
        try:
            chunk = Chunk.read(ReadDataStream(BytesIO(record)))
        except (McapError, struct.error, UnicodeDecodeError):
            self.repairs["damaged chunk skipped"] += 1
            return None
        name_length = len(chunk.compression.encode())
        (announced,) = struct.unpack_from("<Q", record, _CHUNK_HEAD - 8 + name_length)
        whole = len(chunk.data) == announced
        try:
            plain = _decompress(chunk.compression, chunk.data)
        except (zstandard.ZstdError, RuntimeError, EOFError):
            self.repairs["damaged chunk skipped"] += 1
            return None
        if whole and not _is_sound(chunk, plain):
            self.repairs["chunk with wrong checksum skipped"] += 1
            return None
        return plain

    def _by_topic(
        self, data: NDArray[np.uint8], found: Found, wanted: frozenset[str]
    ) -> Iterator[tuple[str, MessageBatch]]:
        channels, batch = found.batch(data)
        for identifier in np.flatnonzero(np.bincount(channels)).tolist():
            channel = self._channels.get(identifier)
            if channel is None:
                self.repairs["messages of an undefined channel skipped"] += int(
                    np.count_nonzero(channels == identifier)
                )
            elif channel.topic in wanted:
                if channel.message_encoding != "cdr":
                    raise RecordingError(
                        f"{self.path}: {channel.topic} is encoded as "
                        f"{channel.message_encoding!r}; only 'cdr' can be read"
                    )
                yield channel.topic, batch.take(channels == identifier)


def _is_sound(chunk: Chunk, plain: bytes) -> bool:
    """Return whether size and checksum are as announced; a checksum of 0 means none."""
    if len(plain) != chunk.uncompressed_size:
        return False
    return chunk.uncompressed_crc == 0 or zlib.crc32(plain) == chunk.uncompressed_crc


def _decompress(compression: str, data: bytes) -> bytes:
    """Return the plain bytes; of a cut-off chunk the leading part that can be had."""
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data))
    if compression == "":
        return data
    raise RecordingError(f"chunk compression {compression!r} is unknown; known: zstd, lz4, none")
