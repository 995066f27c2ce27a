"""The same messages in every kind of file give the same recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mcap.writer
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_typestore

from bags.copies import copy_with_rosbags
from twbr_estimation.bags import BagTopic, TopicNames, mcap_storage, read_recording, write_recording
from twbr_estimation.errors import RecordingError
from twbr_estimation.recording import Recording

Make = Callable[..., Recording]
Same = Callable[[Recording, Recording], None]
DMP = {"dmp": "/imu/dmp"}


@pytest.fixture
def written(tmp_path: Path, small_recording: Make) -> tuple[Path, Recording]:
    """A recording of ours on disk, and what it holds; two chunks' worth."""
    recording = small_recording(samples=1500)
    write_recording(tmp_path / "ours", recording)
    return tmp_path / "ours", recording


def copy_with_mcap(source: Path, target: Path, **options: object) -> None:
    with rosbag2.Reader(source) as bag, target.open("wb") as file:
        writer = mcap.writer.Writer(file, chunk_size=60_000, **options)
        writer.start(profile="ros2")
        channels = {}
        for entry in bag.connections:
            schema = writer.register_schema(entry.msgtype, "ros2msg", entry.msgdef.data.encode())
            channels[entry.id] = writer.register_channel(entry.topic, "cdr", schema)
        for entry, stamp, raw in bag.messages():
            writer.add_message(channels[entry.id], stamp, bytes(raw), stamp)
        writer.finish()


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize("mode", list(CompressionMode))
def test_what_rosbags_writes(
    tmp_path: Path,
    written: tuple[Path, Recording],
    assert_same: Same,
    plugin: StoragePlugin,
    mode: CompressionMode,
) -> None:
    if plugin is StoragePlugin.SQLITE3 and mode is CompressionMode.STORAGE:
        pytest.skip("sqlite3 has no compression of its own")
    copy_with_rosbags(written[0], tmp_path / "copy", plugin, mode)
    got = read_recording(tmp_path / "copy", estimators=DMP)
    assert_same(got, written[1])
    assert got.repairs == {}


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.NONE, "enable_crcs": False},
        {"index_types": IndexType.CHUNK},
        {"index_types": IndexType.NONE, "use_statistics": False, "repeat_channels": False},
        {"use_chunking": False},
    ],
    ids=str,
)
def test_what_the_mcap_library_writes(
    tmp_path: Path,
    written: tuple[Path, Recording],
    assert_same: Same,
    options: dict[str, object],
) -> None:
    copy_with_mcap(written[0], tmp_path / "copy.mcap", **options)
    got = read_recording(tmp_path / "copy.mcap", estimators=DMP)
    assert_same(got, written[1])
    assert got.repairs == {}


def copy_as_ros1(source: Path, path: Path) -> Path:
    ros1, ros2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_JAZZY)
    with rosbag2.Reader(source) as bag, rosbag1.Writer(path) as writer:
        connections = {
            entry.id: writer.add_connection(entry.topic, entry.msgtype, typestore=ros1)
            for entry in bag.connections
        }
        for entry, stamp, raw in bag.messages():
            message = ros2.cdr_to_ros1(raw, entry.msgtype)
            writer.write(connections[entry.id], stamp, bytes(message))
    return path


def test_a_ros1_bag(tmp_path: Path, written: tuple[Path, Recording], assert_same: Same) -> None:
    path = copy_as_ros1(written[0], tmp_path / "copy.bag")
    assert_same(read_recording(path, estimators=DMP), written[1])


def test_a_damaged_ros1_bag_is_read_or_refused(
    tmp_path: Path, written: tuple[Path, Recording]
) -> None:
    path = copy_as_ros1(written[0], tmp_path / "copy.bag")
    whole, random, refused = path.read_bytes(), np.random.default_rng(4), 0
    for place in random.integers(0, len(whole), 60).tolist():
        damaged = bytearray(whole)
        damaged[place : place + 4] = random.bytes(4)
        path.write_bytes(damaged)
        try:
            read_recording(path, estimators=DMP)
        except RecordingError:
            refused += 1
    assert 0 < refused < 60


def test_a_bag_split_into_files_in_any_order(
    tmp_path: Path, written: tuple[Path, Recording], assert_same: Same
) -> None:
    folder = tmp_path / "split"
    folder.mkdir()
    with rosbag2.Reader(written[0]) as bag:
        middle = bag.start_time + bag.duration // 2
        spans = {"split_1.mcap": (None, middle), "split_0.mcap": (middle, None)}
    for name, (start, stop) in spans.items():
        part = tmp_path / f"part_{name}"
        writer = rosbag2.Writer(part, version=9, storage_plugin=StoragePlugin.MCAP)
        with rosbag2.Reader(written[0]) as bag, writer:
            connections = {
                entry.id: writer.add_connection(
                    entry.topic, entry.msgtype, msgdef=entry.msgdef.data, rihs01=entry.digest
                )
                for entry in bag.connections
            }
            for entry, stamp, raw in bag.messages(start=start, stop=stop):
                writer.write(connections[entry.id], stamp, raw)
        (file,) = part.glob("*.mcap")
        file.rename(folder / name)
    got = read_recording(folder, estimators=DMP)
    assert_same(got, written[1])
    assert got.repairs == {}


def test_messages_out_of_order_in_the_file_are_in_order_in_the_recording(
    tmp_path: Path, written: tuple[Path, Recording], assert_same: Same
) -> None:
    with rosbag2.Reader(written[0]) as bag:
        messages = list(bag.messages())
        writer = rosbag2.Writer(tmp_path / "copy", version=9, storage_plugin=StoragePlugin.MCAP)
        with writer:
            connections = {
                entry.id: writer.add_connection(
                    entry.topic, entry.msgtype, msgdef=entry.msgdef.data, rihs01=entry.digest
                )
                for entry in bag.connections
            }
            for index in np.random.default_rng(1).permutation(len(messages)):
                entry, stamp, raw = messages[index]
                writer.write(connections[entry.id], stamp, raw)
    got = read_recording(tmp_path / "copy", estimators=DMP)
    assert_same(got, written[1])
    assert got.repairs == {}


def test_a_real_ros1_bag_and_its_conversion_agree(shared_data: Path) -> None:
    folder = shared_data / "husky_bags"
    names = TopicNames(imu="imu/data")
    one = read_recording(folder / "robot_localization_test1.bag", names)
    two = read_recording(folder / "converted_husky_test1_sqlite3", names)
    assert one.imu.stamps.size == 11865
    np.testing.assert_array_equal(one.imu.stamps, two.imu.stamps)
    np.testing.assert_array_equal(one.imu.gyro, two.imu.gyro)
    np.testing.assert_array_equal(one.imu.accel, two.imu.accel)
    assert one.dt == pytest.approx(1.0 / 30.0, rel=0.01)


def test_chunks_without_wanted_topics_are_not_even_decompressed(
    tmp_path: Path, small_recording: Make, assert_same: Same, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = small_recording()
    stamps = recording.imu.stamps[-1] + 1_000_000 * np.arange(1, 41)
    images = BagTopic("/camera", "sensor_msgs/msg/Image", stamps, [bytes(200_000)] * stamps.size)
    write_recording(tmp_path / "ours", recording, [images])
    unpacked = []

    def counted(compression: str, data: bytes, size: int, whole: bool) -> bytes:
        unpacked.append(len(data))
        return decompress(compression, data, size, whole)

    decompress = mcap_storage.unpacked
    monkeypatch.setattr(mcap_storage, "unpacked", counted)
    copy_with_mcap(tmp_path / "ours", tmp_path / "copy.mcap")
    assert_same(read_recording(tmp_path / "copy.mcap", estimators=DMP), recording)
    with (tmp_path / "copy.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None and len(unpacked) <= 3 < len(summary.chunk_indexes)
