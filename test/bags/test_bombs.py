"""Small files that announce, or hold, far more than a recording are refused in time."""

from __future__ import annotations

import bz2
import struct
import tracemalloc
from pathlib import Path

import lz4.frame
import pytest
import zstandard

from twbr_estimation.bags.ros1_limits import require_bounded
from twbr_estimation.bags.unpacking import (
    CHUNK_LIMIT,
    FREE,
    MESSAGE_LIMIT,
    Allowance,
    DamagedError,
    unpacked_message,
)
from twbr_estimation.errors import RecordingError

LARGE = bytes(1 << 25)
PACKED = {b"bz2": bz2.compress(LARGE), b"lz4": lz4.frame.compress(LARGE)}


def ros1_bag(path: Path, compression: bytes, size: int, data: bytes) -> Path:
    """Write a ROS 1 bag of one chunk that announces `size` bytes."""
    fields = [b"op=\x05", b"compression=" + compression, b"size=" + struct.pack("<I", size)]
    header = b"".join(struct.pack("<I", len(each)) + each for each in fields)
    record = struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data
    path.write_bytes(b"#ROSBAG V2.0\n" + record)
    return path


@pytest.mark.parametrize("compression", sorted(PACKED))
def test_a_ros1_chunk_larger_than_announced_is_refused(tmp_path: Path, compression: bytes) -> None:
    path = ros1_bag(tmp_path / "a.bag", compression, 1000, PACKED[compression])
    tracemalloc.start()
    with pytest.raises(RecordingError, match="holds more than the 1000 bytes"):
        require_bounded(path, Allowance(str(path), path.stat().st_size))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < len(LARGE) / 4, "refused without unpacking all of it"


@pytest.mark.parametrize("compression", sorted(PACKED))
def test_a_ros1_chunk_of_its_announced_size_passes(tmp_path: Path, compression: bytes) -> None:
    path = ros1_bag(tmp_path / "a.bag", compression, len(LARGE), PACKED[compression])
    require_bounded(path, Allowance(str(path), path.stat().st_size))


def test_a_ros1_chunk_that_announces_too_much_is_refused(tmp_path: Path) -> None:
    path = ros1_bag(tmp_path / "a.bag", b"bz2", CHUNK_LIMIT + 1, bz2.compress(b"x"))
    with pytest.raises(RecordingError, match=f"limit is {CHUNK_LIMIT}"):
        require_bounded(path, Allowance(str(path), path.stat().st_size))


def test_ros1_chunks_together_are_limited(tmp_path: Path) -> None:
    path = ros1_bag(tmp_path / "a.bag", b"lz4", len(LARGE), PACKED[b"lz4"])
    allowance = Allowance(str(path), 0)
    allowance.take(FREE)
    with pytest.raises(RecordingError, match="decompression bomb"):
        require_bounded(path, allowance)


def test_a_message_that_announces_too_much_is_damaged() -> None:
    data = zstandard.ZstdCompressor().compress(bytes(MESSAGE_LIMIT + 1))
    with pytest.raises(DamagedError):
        unpacked_message(data, Allowance("a", 0))


def test_a_message_that_hides_its_size_ends_at_the_limit() -> None:
    packer = zstandard.ZstdCompressor().compressobj()
    data = packer.compress(bytes(MESSAGE_LIMIT + 1000)) + packer.flush()
    assert zstandard.frame_content_size(data) == -1
    assert len(unpacked_message(data, Allowance("a", 0))) <= MESSAGE_LIMIT


def test_messages_together_are_limited() -> None:
    allowance = Allowance("a", 0)
    allowance.take(FREE)
    with pytest.raises(RecordingError, match="decompression bomb"):
        unpacked_message(zstandard.ZstdCompressor().compress(bytes(10)), allowance)
