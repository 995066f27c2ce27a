"""The outer records of an MCAP file: their places, and the summary at its end.

The summary is used where its checksum agrees: it names all channels beforehand, gives the
places where chunks start, from which reading goes on after damage, and the number of messages
against which what was found is checked.
"""

from __future__ import annotations

import struct
import zlib
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .mcap_chunk import RECORD_HEAD

MAGIC = b"\x89MCAP0\r\n"
_FOOTER_SIZE = 37
"""Footer record and closing magic number [bytes]."""
_CHUNK_PLACE = 16
"""Place of the chunk's offset in a chunk index."""
_COUNTS = 42
"""Place of the number of messages by channel in the statistics, after their size."""

ByteArray = NDArray[np.uint8]


@dataclass(slots=True)
class Summary:
    """Summary at the end of a file that was closed properly."""

    definitions: list[tuple[int, bytes]] = field(default_factory=list)
    """Opcode and content of schema and channel records."""
    chunks: list[int] = field(default_factory=list)
    """Offsets of chunk records, increasing."""
    counts: dict[int, int] | None = None
    """Number of messages by channel."""


def read_summary(data: ByteArray) -> Summary | None:
    """Return the summary of a file; None where it has none or its checksum is wrong."""
    footer = data[-_FOOTER_SIZE:].tobytes()
    if not (footer[:1] == bytes([Opcode.FOOTER]) and footer.endswith(MAGIC)):
        return None
    start, _, checksum = struct.unpack_from("<QQI", footer, RECORD_HEAD)
    if not len(MAGIC) < start < data.size:
        return None
    if checksum and zlib.crc32(data[start : -len(MAGIC) - 4].tobytes()) != checksum:
        return None
    summary = Summary()
    for opcode, begin, end in outer_records(data, Counter(), start):
        content = data[begin:end].tobytes()
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            summary.definitions.append((opcode, content))
        elif opcode == Opcode.CHUNK_INDEX and len(content) >= _CHUNK_PLACE + 8:
            summary.chunks += struct.unpack_from("<Q", content, _CHUNK_PLACE)
        elif opcode == Opcode.STATISTICS:
            summary.counts = _counts(content)
    summary.chunks = sorted(at for at in summary.chunks if at < start)
    return summary


def _counts(content: bytes) -> dict[int, int] | None:
    if len(content) < _COUNTS + 4:
        return None
    (size,) = struct.unpack_from("<I", content, _COUNTS)
    entries = content[_COUNTS + 4 : _COUNTS + 4 + size // 10 * 10]
    if len(entries) % 10:
        return None
    return dict(struct.iter_unpack("<HQ", entries))


def outer_records(
    data: ByteArray, repairs: Counter[str], at: int, chunks: list[int] | None = None
) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, start and stop of each record's content; the last may be cut off.

    Args:
        data: the whole file.
        repairs: damage is counted here.
        at: where a record starts.
        chunks: where chunk records start, if that is known; after damage, reading goes on there.
    """
    raw, chunks = data.data, chunks or []
    while at + RECORD_HEAD <= data.size:
        opcode, length = struct.unpack_from("<BQ", raw, at)
        start, end = at + RECORD_HEAD, at + RECORD_HEAD + length
        later = bisect_right(chunks, at)
        if later < len(chunks) and (opcode == 0 or end > chunks[later]):
            repairs["damaged records skipped"] += 1
            at = chunks[later]
            continue
        # A file system that lost power pads with zeros, from the middle of a message on.
        padding_follows = opcode == Opcode.MESSAGE and end < data.size and raw[end] == 0
        if opcode == 0 or padding_follows:
            break
        if opcode == Opcode.FOOTER:
            if end + len(MAGIC) != data.size:
                break
            yield opcode, start, end
            return
        yield opcode, start, min(end, data.size)
        at = end
    repairs["file is cut off or damaged; read up to there"] += 1
