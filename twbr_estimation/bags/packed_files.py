"""Bag files that were compressed as a whole, by rosbag2 or by hand."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import lz4.frame
import zstandard

from ..disk.faults import reason_of
from ..errors import RecordingError
from .unpacking import Allowance

PACKED_SUFFIXES = (".zstd", ".zst", ".gz", ".bz2", ".xz", ".lz4")
_PIECE = 1 << 20
_OPENERS: dict[bytes, Callable[[IO[bytes]], Any]] = {
    b"\x28\xb5\x2f\xfd": lambda file: zstandard.ZstdDecompressor().stream_reader(
        file, read_across_frames=True
    ),
    b"\x1f\x8b": lambda file: gzip.GzipFile(fileobj=file),
    b"BZh": bz2.BZ2File,
    b"\xfd7zXZ\x00": lzma.LZMAFile,
    b"\x04\x22\x4d\x18": lz4.frame.LZ4FrameFile,
}
"""Reader of a compressed file, by the file's first bytes."""
_DAMAGE = (EOFError, RuntimeError, ValueError, zlib.error, lzma.LZMAError, zstandard.ZstdError)


def is_packed(head: bytes) -> bool:
    """Return whether a file that starts so is compressed as a whole."""
    return _opener(head) is not None


def unpack(path: Path, head: bytes, target: Path, allowance: Allowance) -> None:
    """Write the plain content of a compressed file.

    Raises:
        RecordingError: it is damaged, unpacks to far more than its size, or there is no room.
    """
    opener = _opener(head)
    assert opener is not None
    try:
        with (
            path.open("rb") as packed,
            opener(packed) as reader,
            target.open("wb") as plain,
        ):
            while piece := reader.read(_PIECE):
                allowance.take(len(piece))
                plain.write(piece)
        if not target.stat().st_size:
            raise EOFError("it ends before its first content")
    except _DAMAGE as error:
        raise RecordingError(f"{path}: cannot be decompressed: {error}") from error
    except OSError as error:
        where = target.parent.parent
        raise RecordingError(
            f"{path}: cannot be decompressed into {where}: {reason_of(error)} "
            "(the variable TMPDIR names another folder)"
        ) from error


def _opener(head: bytes) -> Callable[[IO[bytes]], Any] | None:
    return next((each for magic, each in _OPENERS.items() if head.startswith(magic)), None)
