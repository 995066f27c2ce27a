"""What is written is read back, by us and by rosbags; other writers' bags read the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from twbr_estimation.bags import read_recording, write_recording
from twbr_estimation.errors import RecordingError
from twbr_estimation.recording import ImuTrack, Recording
from twbr_estimation.samples import LAST_STAMP

Make = Callable[..., Recording]
Same = Callable[[Recording, Recording], None]
DMP = {"dmp": "/imu/dmp"}


@pytest.mark.parametrize(("wheels", "motors"), [(1, 1), (2, 2)])
def test_what_is_written_is_read_back_without_repairs(
    tmp_path: Path, wheels: int, motors: int, small_recording: Make, assert_same: Same
) -> None:
    recording = small_recording(wheels=wheels, motors=motors)
    write_recording(tmp_path / "bag", recording)
    got = read_recording(tmp_path / "bag", estimators=DMP)
    assert_same(got, recording)
    assert got.repairs == {}
    assert got.temperature is not None and recording.temperature is not None
    np.testing.assert_array_equal(got.temperature.temperature, recording.temperature.temperature)


def test_only_the_imu_is_needed(tmp_path: Path, small_recording: Make) -> None:
    recording = replace(small_recording(), wheels=None, reference=None, truth=None)
    write_recording(tmp_path / "bag", replace(recording, estimators={}))
    got = read_recording(tmp_path / "bag")
    assert (got.wheels, got.reference, got.truth) == (None, None, None)


def test_a_single_file_reads_like_its_directory(
    tmp_path: Path, small_recording: Make, assert_same: Same
) -> None:
    write_recording(tmp_path / "bag", small_recording())
    (file,) = (tmp_path / "bag").glob("*.mcap")
    assert_same(read_recording(file), read_recording(tmp_path / "bag"))


def test_the_same_recording_gives_the_same_bytes(tmp_path: Path, small_recording: Make) -> None:
    for name in ("one", "two"):
        write_recording(tmp_path / name / "bag", small_recording())
    one, two = (next((tmp_path / name).rglob("*.mcap")) for name in ("one", "two"))
    assert one.read_bytes() == two.read_bytes()


def test_rosbags_reads_the_same_numbers(tmp_path: Path, small_recording: Make) -> None:
    recording = small_recording()
    write_recording(tmp_path / "bag", recording)
    with AnyReader([tmp_path / "bag"]) as reader:
        imu = [c for c in reader.connections if c.topic == "/imu/data_raw"]
        messages = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(imu)]
    gyro = [[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for m in messages]
    np.testing.assert_array_equal(gyro, recording.imu.gyro)
    stamp = messages[3].header.stamp
    assert stamp.sec * 10**9 + stamp.nanosec == recording.imu.stamps[3]


def test_an_existing_recording_is_kept_unless_asked(
    tmp_path: Path, small_recording: Make, assert_same: Same
) -> None:
    write_recording(tmp_path / "bag", small_recording(seed=1))
    with pytest.raises(RecordingError, match="exists"):
        write_recording(tmp_path / "bag", small_recording(seed=2))
    write_recording(tmp_path / "bag", small_recording(seed=2), overwrite=True)
    assert_same(read_recording(tmp_path / "bag", estimators=DMP), small_recording(seed=2))


def test_what_is_no_recording_is_never_deleted(tmp_path: Path, small_recording: Make) -> None:
    (tmp_path / "precious").mkdir()
    with pytest.raises(RecordingError, match="not a recording"):
        write_recording(tmp_path / "precious", small_recording(), overwrite=True)
    assert (tmp_path / "precious").is_dir()


def test_the_mcap_library_finds_everything_by_the_index(
    tmp_path: Path, small_recording: Make
) -> None:
    write_recording(tmp_path / "bag", small_recording())
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        times = [message.log_time for _, _, message in reader.iter_messages()]
    assert header.profile == "ros2" and summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == len(times) == 50 * 5 + 5
    assert times == sorted(times)
    schemas = {schema.name: schema.encoding for schema in summary.schemas.values()}
    assert schemas["sensor_msgs/msg/Imu"] == "ros2msg"


@pytest.mark.parametrize("shift", [-1, LAST_STAMP])
def test_stamps_that_a_message_cannot_hold_are_refused(tmp_path: Path, shift: int) -> None:
    imu = ImuTrack(np.array([0, 1]) + shift, np.zeros((2, 3)), np.ones((2, 3)))
    with pytest.raises(RecordingError, match=r"/imu/data_raw: stamps from .* a message holds"):
        write_recording(tmp_path / "bag", Recording("made up", imu))
    assert not (tmp_path / "bag").exists()
