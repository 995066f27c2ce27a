"""Fill in the checksums of an MCAP file whose writer left them out, and check that of the whole.

The format has three: one of each chunk's plain records, one of the data section (all bytes
before the record that ends it), and one of the summary.
"""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path

import numpy as np
import zstandard
from mcap.opcode import Opcode
from numpy.typing import NDArray

_MAGIC_SIZE = 8
_RECORD_HEAD = 9
_CHUNK_TIMES = 16
_BLOCK = 1 << 24
"""Bytes summed at once."""


def add_checksums(path: Path) -> None:
    """Write the checksums into a file of zstd-compressed or plain chunks.

    Raises:
        OSError: it cannot be read or written.
    """
    descriptor = os.open(path, os.O_RDWR)
    try:
        data = np.memmap(path, dtype=np.uint8, mode="r")
        at = _MAGIC_SIZE
        while at + _RECORD_HEAD <= data.size:
            opcode, length = struct.unpack_from("<BQ", data.data, at)
            content = at + _RECORD_HEAD
            if opcode == Opcode.CHUNK:
                plain = _plain(data[content : content + length].tobytes())
                _put(descriptor, content + _CHUNK_TIMES + 8, zlib.crc32(plain))
            elif opcode == Opcode.DATA_END:
                _put(descriptor, content, data_checksum(data, at))
            elif opcode == Opcode.FOOTER:
                (start,) = struct.unpack_from("<Q", data.data, content)
                _put(descriptor, content + 16, zlib.crc32(data[start : content + 16].data))
                break
            at = content + length
    finally:
        os.close(descriptor)


def data_checksum(data: NDArray[np.uint8], stop: int) -> int:
    """Return the checksum of the bytes before `stop`, block by block."""
    checksum = 0
    for start in range(0, stop, _BLOCK):
        checksum = zlib.crc32(data[start : min(start + _BLOCK, stop)].data, checksum)
    return checksum


def _plain(record: bytes) -> bytes:
    """Return the records of a chunk that our own writer made."""
    size, _, name_length = struct.unpack_from("<QII", record, _CHUNK_TIMES)
    name_start = _CHUNK_TIMES + 16
    start = name_start + name_length + 8
    if record[name_start : name_start + name_length] != b"zstd":
        return record[start:]
    return zstandard.ZstdDecompressor().decompress(record[start:], max_output_size=size)


def _put(descriptor: int, offset: int, checksum: int) -> None:
    os.pwrite(descriptor, struct.pack("<I", checksum), offset)
