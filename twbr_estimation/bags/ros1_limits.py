"""Check the chunks of a ROS 1 bag before a library unpacks them without limit."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Iterator
from pathlib import Path

import lz4.frame
import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from .unpacking import CHUNK_LIMIT, Allowance

_FIRST_RECORD = 13
"""Length of the line that a bag starts with [bytes]."""
_CHUNK = b"\x05"


def require_bounded(path: Path, allowance: Allowance) -> None:
    """Refuse a bag whose chunks hold more than they announce, or than the allowance.

    What is damaged in another way is left to the reader.

    Raises:
        RecordingError: a chunk is too large, or holds more than it announces.
    """
    data = np.memmap(path, dtype=np.uint8, mode="r")
    for header, start, stop in _records(data):
        compression = header.get(b"compression", b"none")
        if header.get(b"op") != _CHUNK or compression == b"none":
            continue
        size = int.from_bytes(header.get(b"size", b"")[:4], "little")
        if size > CHUNK_LIMIT:
            raise RecordingError(
                f"{path}: a chunk announces {size} bytes; the limit is {CHUNK_LIMIT}"
            )
        allowance.take(size)
        if _unpacked_size(compression, data[start:stop].tobytes(), size + 1) > size:
            raise RecordingError(f"{path}: a chunk holds more than the {size} bytes it announces")


def _records(data: NDArray[np.uint8]) -> Iterator[tuple[dict[bytes, bytes], int, int]]:
    """Yield header fields, start and stop of each record's data, up to what is damaged."""
    at = _FIRST_RECORD
    while at + 4 <= data.size:
        (length,) = struct.unpack_from("<I", data.data, at)
        start = at + 4 + length
        if start + 4 > data.size:
            return
        header = data[at + 4 : start].tobytes()
        (size,) = struct.unpack_from("<I", data.data, start)
        at = start + 4 + size
        yield _fields(header), start + 4, min(at, data.size)


def _fields(header: bytes) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at + 4 <= len(header):
        (length,) = struct.unpack_from("<I", header, at)
        name, _, value = header[at + 4 : at + 4 + length].partition(b"=")
        fields[name] = value
        at += 4 + length
    return fields


def _unpacked_size(compression: bytes, data: bytes, limit: int) -> int:
    """Return how many bytes come out, at most `limit`; 0 for what cannot be unpacked."""
    try:
        if compression == b"bz2":
            return len(bz2.BZ2Decompressor().decompress(data, max_length=limit))
        if compression == b"lz4":
            return len(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=limit))
    except (OSError, RuntimeError, EOFError, MemoryError):
        pass
    return 0
