"""Damage is said, bombs are refused, and what is not needed costs no message."""

from __future__ import annotations

import gzip
import os
import random
import resource
import sqlite3
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader

from twbr_estimation.bags import TopicNames, read_recording, write_recording
from twbr_estimation.bags.mcap_records import MAGIC, outer_records
from twbr_estimation.bags.topics import full_type
from twbr_estimation.errors import TwbrError
from twbr_estimation.recording import Recording

Make = Callable[..., Recording]


def mcap_of(bag: Path) -> Path:
    return bag / f"{bag.name}.mcap"


def same(one: Recording, two: Recording) -> bool:
    pairs = [(one.imu.stamps, two.imu.stamps), (one.imu.gyro, two.imu.gyro)]
    pairs.append((one.imu.accel, two.imu.accel))
    if one.wheels is not None and two.wheels is not None:
        pairs.append((one.wheels.angle, two.wheels.angle))
    return (one.wheels is None) == (two.wheels is None) and all(
        np.array_equal(first, second) for first, second in pairs
    )


def test_our_recordings_carry_all_checksums(tmp_path: Path, small_recording: Make) -> None:
    write_recording(tmp_path / "bag", small_recording(3000))
    with mcap_of(tmp_path / "bag").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) > 6000
        summary = reader.get_summary()
        assert summary is not None and len(summary.chunk_indexes) > 1
    data = np.memmap(mcap_of(tmp_path / "bag"), dtype=np.uint8, mode="r")
    seen = Counter[int]()
    for opcode, start, _ in outer_records(data, Counter(), len(MAGIC)):
        place = {6: start + 24, 15: start, 2: start + 16}.get(opcode)
        if place is not None:
            seen[opcode] += struct.unpack_from("<I", data.data, place)[0] != 0
    assert seen[6] > 1 and seen[15] == 1 and seen[2] == 1


def test_no_changed_byte_goes_unnoticed(tmp_path: Path, small_recording: Make) -> None:
    bag = tmp_path / "bag"
    write_recording(bag, small_recording(600))
    whole, content, chance = read_recording(bag), mcap_of(bag).read_bytes(), random.Random(1)
    changed_figures = 0
    for _ in range(150):
        changed = bytearray(content)
        place = chance.randrange(8, len(changed))
        changed[place] ^= 1 << chance.randrange(8)
        mcap_of(bag).write_bytes(changed)
        try:
            found = read_recording(bag)
        except TwbrError:
            continue
        if not same(found, whole):
            changed_figures += 1
            assert found.repairs, f"byte {place} changes figures without a word"
    mcap_of(bag).write_bytes(content)
    assert read_recording(bag).repairs == whole.repairs


def test_a_wrong_length_anywhere_is_said(tmp_path: Path, small_recording: Make) -> None:
    bag = tmp_path / "bag"
    write_recording(bag, small_recording(2500))
    whole, content = read_recording(bag), mcap_of(bag).read_bytes()
    data = np.frombuffer(content, dtype=np.uint8)
    places = [start - 8 for _, start, _ in outer_records(data, Counter(), len(MAGIC))]
    for place in places:
        for length in (0, 1, 7, 1 << 20, 1 << 40, (1 << 64) - 1):
            changed = bytearray(content)
            struct.pack_into("<Q", changed, place, length)
            mcap_of(bag).write_bytes(changed)
            try:
                found = read_recording(bag)
            except TwbrError:
                continue
            assert found.repairs or same(found, whole), (place, length)


def with_chunk(path: Path, compression: bytes, size: int, data: bytes) -> None:
    head = struct.pack("<QQQI", 0, 1, size, 0) + struct.pack("<I", len(compression)) + compression
    record = head + struct.pack("<Q", len(data)) + data
    path.write_bytes(MAGIC + b"\x06" + struct.pack("<Q", len(record)) + record)


def zeros(number: int) -> bytes:
    packer = zstandard.ZstdCompressor().compressobj()
    return b"".join(packer.compress(bytes(1 << 20)) for _ in range(number)) + packer.flush()


@pytest.mark.parametrize(
    ("compression", "size", "what"),
    [
        (b"zstd", 1 << 32, "more than 256 MiB"),
        (b"zstd", 1 << 63, "more than 256 MiB"),
        (b"zstd", 1000, "damaged chunk"),
        (b"lz4", 1000, "damaged chunk"),
        (b"lz4", 1 << 30, "more than 256 MiB"),
        (b"snappy", 10, "unknown compression 'snappy'"),
    ],
)
def test_a_chunk_that_claims_or_holds_too_much_is_refused(
    tmp_path: Path, compression: bytes, size: int, what: str
) -> None:
    data = lz4.frame.compress(bytes(300 << 20)) if compression == b"lz4" else zeros(300)
    with_chunk(tmp_path / "bomb.mcap", compression, size, data)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(TwbrError, match=what):
        read_recording(tmp_path / "bomb.mcap")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 400_000


def test_a_file_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bag.mcap.zstd").write_bytes(zeros(600))
    with pytest.raises(TwbrError, match="refused as a decompression bomb"):
        read_recording(tmp_path / "bag.mcap.zstd")


@pytest.mark.parametrize("suffix", [".gz", ".lz4", ".zst"])
def test_a_file_compressed_by_hand_is_read(
    tmp_path: Path, small_recording: Make, suffix: str
) -> None:
    bag = tmp_path / "bag"
    write_recording(bag, small_recording())
    whole, content = read_recording(bag), mcap_of(bag).read_bytes()
    pack = {".gz": gzip.compress, ".lz4": lz4.frame.compress, ".zst": zstandard.compress}[suffix]
    mcap_of(bag).with_name(f"bag.mcap{suffix}").write_bytes(pack(content))
    mcap_of(bag).unlink()
    assert same(read_recording(bag), whole)
    mcap_of(bag).with_name(f"bag.mcap{suffix}").write_bytes(pack(content)[:-40])
    with pytest.raises(TwbrError, match="cannot be decompressed"):
        read_recording(bag)


@pytest.mark.parametrize("text", ["", "[[", "a: 1", "rosbag2_bagfile_information: 3", "\x00"])
def test_metadata_that_cannot_be_used_are_said_and_done_without(
    tmp_path: Path, small_recording: Make, text: str
) -> None:
    bag = tmp_path / "bag"
    write_recording(bag, small_recording())
    whole = read_recording(bag)
    (bag / "metadata.yaml").write_text(text)
    found = read_recording(bag)
    assert same(found, whole)
    assert any(repair.startswith("metadata.yaml: ") for repair in found.repairs)


def test_pipes_and_devices_are_no_recordings(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "bag.mcap")
    for path in (tmp_path / "bag.mcap", Path("/dev/zero")):
        with pytest.raises(TwbrError, match="cannot be read: it is"):
            read_recording(path)


ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
TOPICS = "CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT);"
IMU = "INSERT INTO topics VALUES (1, '/imu/data_raw', 'sensor_msgs/msg/Imu', 'cdr');"
ROW = "INSERT INTO messages VALUES (1, 1, "
MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp, data);"


@pytest.mark.parametrize(
    ("script", "what"),
    [
        (f"CREATE VIEW topics AS {ENDLESS} SELECT i id, 'a' name FROM n;", "topics is a view"),
        (f"{TOPICS}{IMU}CREATE VIEW messages AS {ENDLESS} SELECT i id FROM n;", "is a view"),
        (f"{TOPICS}{IMU}{MESSAGES}INSERT INTO messages VALUES (1, 1, 'abc', x'00');", "damaged"),
        (f"{TOPICS}{IMU}{MESSAGES}INSERT INTO messages VALUES (1, 1, 9, NULL);", "damaged"),
        (f"{TOPICS}{IMU}{MESSAGES}INSERT INTO messages VALUES (1, 1, 9, 'text');", "damaged"),
        (f"{TOPICS}{IMU}{MESSAGES}INSERT INTO messages VALUES (1, 1, 9.5e18, x'00');", "damaged"),
        (f"{TOPICS}{IMU}{MESSAGES}{ROW}9, zeroblob(90000000));", "damaged"),
        (f"{TOPICS}INSERT INTO topics VALUES (NULL, 5, 6, 7);{MESSAGES}", "damaged topics"),
    ],
)  # fmt: skip
def test_a_database_of_another_kind_is_refused(tmp_path: Path, script: str, what: str) -> None:
    path = tmp_path / "bag.db3"
    database = sqlite3.connect(path)
    database.executescript(script)
    database.close()
    with pytest.raises(TwbrError, match=what):
        read_recording(path)


@pytest.mark.parametrize(
    "name",
    [
        "sensor_msgs/Imu",
        "sensor_msgs::msg::dds_::Imu_",
        "sensor_msgs.msg.Imu",
        "sensor_msgs.msg._imu.Imu",
        "/sensor_msgs/msg/Imu",
        "sensor_msgs/msg/Imu",
    ],
)
def test_types_have_their_names_of_today(name: str) -> None:
    assert full_type(name) == "sensor_msgs/msg/Imu"


def test_what_is_no_type_stays() -> None:
    assert [full_type(name) for name in ("", "Imu", "a/b/c/d")] == ["", "Imu", "a/b/c/d"]


def test_topics_without_a_slash_are_found(tmp_path: Path, small_recording: Make) -> None:
    bag = tmp_path / "bag"
    write_recording(bag, small_recording())
    whole = read_recording(bag)
    assert same(read_recording(bag, TopicNames(imu="imu/data_raw")), whole)
