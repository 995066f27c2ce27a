"""Find the messages inside a buffer of MCAP records.

The message index gives their offsets; whatever it does not cover is walked record by
record, so an absent, incomplete or wrong index costs time, never messages.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .message_batch import IntArray, MessageBatch

RECORD_HEAD = 9
"""Opcode and length before each record's content [bytes]."""
MESSAGE_HEAD = 22
"""Channel, sequence, log time and publish time before a message's data [bytes]."""
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])

ByteArray = NDArray[np.uint8]


class RecordStarts:
    """Offsets of message records in a buffer."""

    def __init__(self) -> None:
        self._starts: list[int] = []
        self.indexed: IntArray = np.empty(0, dtype=np.int64)
        """Starts that a message index gave."""
        self.ends_early = False
        """Whether the records' lengths do not add up to the buffer's."""

    def add(self, data: ByteArray, start: int, stop: int) -> None:
        """Note one message record from `start`; one that is cut off before `stop` is not."""
        (length,) = struct.unpack_from("<Q", data.data, start + 1)
        if length >= MESSAGE_HEAD and start + RECORD_HEAD + length <= stop:
            self._starts.append(start)

    def batch(self, data: ByteArray) -> tuple[IntArray, MessageBatch]:
        """Return each message's channel, and the messages in the order of the buffer."""
        starts = np.concatenate([self.indexed, np.array(self._starts, dtype=np.int64)])
        starts.sort()
        view = MessageBatch(data, starts, starts, starts)
        sizes = view.at(starts + 1, "<u8").astype(np.int64) - MESSAGE_HEAD
        channels = view.at(starts + RECORD_HEAD, "<u2").astype(np.int64)
        times = view.at(starts + RECORD_HEAD + 6, "<u8").astype(np.int64)
        payload = starts + RECORD_HEAD + MESSAGE_HEAD
        return channels, MessageBatch(data, payload, sizes, times)


def messages_in(
    data: ByteArray, index: Sequence[memoryview], define: Callable[[int, bytes], None]
) -> RecordStarts:
    """Return the messages of one decompressed chunk.

    Where the index and the records' own lengths contradict each other, the lengths rule.

    Args:
        data: The chunk's records.
        index: Contents of the message index records that belong to the chunk.
        define: Called with opcode and content of each schema and channel record.
    """
    found = RecordStarts()
    starts = _indexed_starts(data, index)
    view = MessageBatch(data, starts, starts, starts)
    stops = starts + RECORD_HEAD + view.at(starts + 1, "<u8").astype(np.int64)
    lows, highs = np.insert(stops, 0, 0), np.append(starts, data.size)
    tiled = bool(np.all(lows <= highs))
    gaps = np.flatnonzero(highs > lows).tolist() if tiled else []
    found.indexed = starts
    for gap in gaps:
        low, high = int(lows[gap]), int(highs[gap])
        tiled &= _walk(data, low, high, found, define) == high
    if not tiled:
        found = RecordStarts()
        found.ends_early = _walk(data, 0, data.size, found, define) != data.size
    return found


def _indexed_starts(data: ByteArray, index: Sequence[memoryview]) -> IntArray:
    """Return the offsets of messages in the index, sorted; nothing if the index is wrong."""
    parts = []
    for content in index:
        if len(content) < 6:
            continue
        entries = np.frombuffer(content, dtype=np.uint8)[6:]
        entries = entries[: entries.size // 16 * 16]
        parts.append(entries.view(_INDEX_ENTRY)["offset"])
    if not parts:
        return np.empty(0, dtype=np.int64)
    starts: IntArray = np.sort(np.concatenate(parts).astype(np.int64))
    starts = starts[np.diff(starts, prepend=-1) > 0]
    none: IntArray = np.empty(0, dtype=np.int64)
    inside = (starts >= 0) & (starts + RECORD_HEAD + MESSAGE_HEAD <= data.size)
    if not inside.all() or not np.all(data[starts] == Opcode.MESSAGE):
        return none
    lengths = MessageBatch(data, starts, starts, starts).at(starts + 1, "<u8")
    return starts if np.all((lengths >= MESSAGE_HEAD) & (lengths <= data.size)) else none


def _walk(
    data: ByteArray, at: int, stop: int, found: RecordStarts, define: Callable[[int, bytes], None]
) -> int:
    """Note the records from `at` on; return where the last one ends by its own length."""
    raw = data.data
    while at + RECORD_HEAD <= stop:
        opcode, length = struct.unpack_from("<BQ", raw, at)
        end = at + RECORD_HEAD + length
        if opcode == Opcode.MESSAGE:
            found.add(data, at, stop)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL) and end <= stop:
            define(opcode, data[at + RECORD_HEAD : end].tobytes())
        elif opcode == 0:
            break
        at = end
    return int(at)
