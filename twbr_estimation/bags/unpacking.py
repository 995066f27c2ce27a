"""Decompress what others compressed, within limits of memory and time.

A few bytes can claim, or hold, terabytes. Nothing here makes more than what was announced, no
single piece is larger than its limit, and a file as a whole unpacks to no more than a multiple of
its size that recordings do not reach. Messages of live sensors rarely shrink to less than a tenth.
The most that was measured is some minutes of an IMU whose readings never change: 49 times by
zstd -19, 56 times where its stamps stay 0, too, and 59 times by xz.
"""

from __future__ import annotations

import lz4.frame
import zstandard

from ..disk.faults import megabytes
from ..errors import RecordingError

CHUNK_LIMIT = 1 << 28
"""Largest chunk of records [bytes]."""
MESSAGE_LIMIT = 1 << 26
"""Largest message [bytes]."""
RATIO_LIMIT = 100
"""Most bytes that a byte of a file may unpack to, beyond `FREE`."""
FREE = 1 << 28
"""Largest unpacked size of any file [bytes]."""
COMPRESSIONS = ("", "zstd", "lz4")
"""Compression formats of chunks."""
DAMAGED = "damaged chunk skipped"
_PIECE = 1 << 20


class DamagedError(Exception):
    """Compressed data that cannot be unpacked as announced."""


class Allowance:
    """Bytes of one file that may still be unpacked."""

    def __init__(self, name: str, size: int) -> None:
        """Take the file's name for messages and its size on disk [bytes]."""
        self._name, self._size = name, size
        self._limit = FREE + RATIO_LIMIT * size
        self._used = 0

    def take(self, size: int) -> None:
        """Count `size` bytes that are about to be unpacked.

        Raises:
            RecordingError: the file unpacks to more than any recording of its size.
        """
        self._used += size
        if self._used > self._limit:
            raise RecordingError(
                f"{self._name}: {megabytes(self._size)} unpack to more than "
                f"{megabytes(self._limit)}, the limit for a file of this size; "
                "it is refused as a decompression bomb"
            )


def unpacked(compression: str, data: bytes, size: int, whole: bool) -> bytes:
    """Return the plain bytes of a chunk that announces `size` of them.

    Args:
        compression: one of `COMPRESSIONS`.
        data: the compressed bytes.
        size: how many plain bytes are announced.
        whole: whether the data are complete; else the leading part is returned.

    Raises:
        DamagedError: another content or size.
    """
    if compression == "":
        plain = data
    elif compression == "lz4":
        plain = _lz4(data, size)
    else:
        plain = _zstd(data, size) if whole else _leading_zstd(data, size)
    if whole and len(plain) != size:
        raise DamagedError(DAMAGED)
    return plain


def unpacked_message(data: bytes, allowance: Allowance) -> bytes:
    """Return the plain bytes of a message that was compressed separately.

    Raises:
        DamagedError: it cannot be unpacked, or is larger than any message.
        RecordingError: the allowance is used up.
    """
    try:
        size = zstandard.frame_content_size(data)
        if size > MESSAGE_LIMIT:
            raise DamagedError(DAMAGED)
        allowance.take(max(size, 0))
        if size >= 0:
            return zstandard.ZstdDecompressor().decompress(data, max_output_size=max(size, 1))
        plain = _leading_zstd(data, MESSAGE_LIMIT)
    except (zstandard.ZstdError, MemoryError) as error:
        raise DamagedError(DAMAGED) from error
    allowance.take(len(plain))
    return plain


def _zstd(data: bytes, size: int) -> bytes:
    try:
        stated = zstandard.frame_content_size(data)
        if stated not in (-1, size):
            raise DamagedError(DAMAGED)
        return zstandard.ZstdDecompressor().decompress(data, max_output_size=max(size, 1))
    except zstandard.ZstdError as error:
        raise DamagedError(DAMAGED) from error


def _leading_zstd(data: bytes, size: int) -> bytes:
    """Return what can be had of at most `size` bytes; data may be cut off."""
    pieces, left = [], size
    with zstandard.ZstdDecompressor().stream_reader(data) as reader:
        try:
            while left and (piece := reader.read(min(left, _PIECE))):
                pieces.append(piece)
                left -= len(piece)
        except zstandard.ZstdError as error:
            if not pieces:
                raise DamagedError(DAMAGED) from error
    return b"".join(pieces)


def _lz4(data: bytes, size: int) -> bytes:
    try:
        plain = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    except (RuntimeError, EOFError, MemoryError) as error:
        raise DamagedError(DAMAGED) from error
    return bytes(plain)
