"""A recording that is written message by message."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.bags import TopicNames, read_recording
from twbr_estimation.bags.encoding import imu_messages
from twbr_estimation.bags.recorder import BagRecorder
from twbr_estimation.bags.topics import IMU
from twbr_estimation.errors import RecordingError
from twbr_estimation.recording import ImuTrack


def imu(count: int) -> ImuTrack:
    stamps = 1_700_000_000_000_000_000 + np.arange(count) * 5_000_000
    draw = np.random.default_rng(1)
    return ImuTrack(stamps, draw.normal(size=(count, 3)), draw.normal(size=(count, 3)))


def test_what_was_added_is_read_back(tmp_path: Path) -> None:
    track, target = imu(500), tmp_path / "deep" / "drive"
    recorder = BagRecorder(target, {TopicNames().imu: IMU})
    for stamp, message in zip(track.stamps, imu_messages(track), strict=True):
        recorder.add(TopicNames().imu, int(stamp) + 1000, message)
    assert not target.exists(), "a recording has its name once it is whole"
    recorder.close()
    assert sorted(each.name for each in target.iterdir()) == ["drive.mcap", "metadata.yaml"]
    assert "partial" not in (target / "metadata.yaml").read_text()
    assert [each.name for each in target.parent.iterdir()] == ["drive"]
    read = read_recording(target)
    assert recorder.messages == 500
    np.testing.assert_array_equal(read.imu.stamps, track.stamps)
    np.testing.assert_array_equal(read.imu.gyro, track.gyro)
    recorder.add(TopicNames().imu, 0, b"late")  # what a subscription still delivers
    recorder.close()
    assert recorder.messages == 500


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "drive").mkdir()
    with pytest.raises(RecordingError, match="drive: exists"):
        BagRecorder(tmp_path / "drive", {TopicNames().imu: IMU})


def test_a_folder_that_cannot_be_made_is_an_error_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="cannot be written"):
        BagRecorder(tmp_path / "file" / "drive", {TopicNames().imu: IMU})


def test_times_that_a_recording_cannot_hold_do_not_end_it(tmp_path: Path) -> None:
    track, topic = imu(4), TopicNames().imu
    recorder = BagRecorder(tmp_path / "drive", {topic: IMU})
    for time, message in zip((-5, 0, 1 << 70, 7), imu_messages(track), strict=True):
        recorder.add(topic, time, message)
    recorder.close()
    assert read_recording(tmp_path / "drive").imu.stamps.size == 4


@pytest.mark.parametrize("kind", ["foo_msgs/msg/Bar", "sensor_msgs/Imu", "", None])
def test_an_unknown_type_is_named_and_leaves_nothing(tmp_path: Path, kind: str | None) -> None:
    with pytest.raises(RecordingError, match=f"/a: {kind!r} is no message type of ROS 2 Jazzy"):
        BagRecorder(tmp_path / "drive", {TopicNames().imu: IMU, "/a": kind})  # type: ignore[dict-item]
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_ends_the_recording_and_is_said_at_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = BagRecorder(tmp_path / "drive", {TopicNames().imu: IMU})

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recorder._writer, "write", full)
    for _ in range(3):
        recorder.add(TopicNames().imu, 1, imu_messages(imu(1))[0])
    assert recorder.messages == 0
    with pytest.raises(RecordingError, match=r"drive: cannot be written: no space left .*free in"):
        recorder.close()
    assert not list(tmp_path.iterdir()), "nothing had been written that could be read"
    recorder.close()


def filled(recorder: BagRecorder, count: int) -> None:
    track = imu(count)
    for stamp, message in zip(track.stamps, imu_messages(track), strict=True):
        recorder.add(TopicNames().imu, int(stamp), message)


def test_what_a_full_disk_took_is_kept_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = BagRecorder(tmp_path / "drive", {TopicNames().imu: IMU})
    filled(recorder, 5000)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recorder._writer, "close", full)
    with pytest.raises(RecordingError, match="drive_cut_off has the beginning"):
        recorder.close()
    assert [each.name for each in tmp_path.iterdir()] == ["drive_cut_off"]
    assert read_recording(tmp_path / "drive_cut_off").imu.stamps.size > 2000


def test_the_next_recorder_keeps_what_a_killed_one_had_written(tmp_path: Path) -> None:
    child = os.fork()
    if not child:  # killed with 5000 messages taken, some 2900 of them in whole chunks
        recorder = BagRecorder(tmp_path / "drive", {TopicNames().imu: IMU})
        filled(recorder, 5000)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    assert [each.name.startswith(".drive.") for each in tmp_path.iterdir()] == [True]
    after = BagRecorder(tmp_path / "later", {TopicNames().imu: IMU})
    assert after.recovered == [tmp_path / "drive_cut_off"]
    running = BagRecorder(tmp_path / "beside", {TopicNames().imu: IMU})
    assert running.recovered == [], "a recorder that still runs is left alone"
    for each in (after, running):
        filled(each, 10)
        each.close()
    assert {each.name for each in tmp_path.iterdir()} == {"drive_cut_off", "later", "beside"}
    kept = read_recording(tmp_path / "drive_cut_off").imu
    np.testing.assert_array_equal(kept.stamps, imu(5000).stamps[: kept.stamps.size])
    assert kept.stamps.size > 2000
