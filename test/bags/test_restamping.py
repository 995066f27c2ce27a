"""Recordings whose senders have another clock, or none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from twbr_estimation.bags import TopicNames, read_recording
from twbr_estimation.bags.decoding import Columns
from twbr_estimation.bags.restamping import restamped
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.samples import Stamps

STORE = get_typestore(Stores.ROS2_JAZZY)
IMU = "sensor_msgs/msg/Imu"
START, PERIOD = 1_700_000_000_000_000_000, 5_000_000
SHORTEST = 800_000
"""Shortest delay of a message [ns]."""


def columns(device: np.ndarray, recorded: np.ndarray) -> Columns:
    frames = np.full(device.size, "", dtype=object)
    return Columns(device, recorded, np.zeros((device.size, 1)), frames)


def truth(seconds: float = 60.0) -> np.ndarray:
    return START + np.arange(round(seconds * 1e9 / PERIOD), dtype=np.int64) * PERIOD


def late(true: np.ndarray, seed: int) -> np.ndarray:
    """Return when messages are recorded that come in bursts, one after the other."""
    noise = np.random.default_rng(seed)
    delays = SHORTEST + noise.exponential(3e6, true.size).astype(np.int64)
    bursts = -(-(true + delays) // 16_000_000) * 16_000_000
    arrived = np.where(noise.random(true.size) < 0.3, true + delays, bursts)
    return np.maximum.accumulate(arrived)


@pytest.mark.parametrize("drift", [0.0, 80e-6, -5000e-6])
@pytest.mark.parametrize("seed", [21, 22])
def test_a_device_clock_is_related_to_that_of_the_recorder(drift: float, seed: int) -> None:
    true = truth()
    device = 3_000_000_000 + np.rint((true - START) * (1.0 + drift)).astype(np.int64)
    repairs: Counter[str] = Counter()
    found = restamped("/imu", columns(device, late(true, seed)), Stamps.DEVICE, repairs)
    error = (found.stamps - true - SHORTEST) * 1e-9
    assert np.all(np.abs(error) < 0.5e-3)
    assert repairs == {"/imu: stamps related to the time of recording": true.size}


def test_a_device_that_starts_again_is_related_again() -> None:
    true = truth()
    device = true - START + 3_000_000_000
    device[6000:] -= device[6000] - 1
    repairs: Counter[str] = Counter()
    found = restamped("/imu", columns(device, late(true, 23)), Stamps.DEVICE, repairs)
    assert np.all(np.abs(found.stamps - true - SHORTEST) < 500_000)
    assert repairs["/imu: starts of the device's clock"] == 1


def test_messages_without_a_stamp_stay_so() -> None:
    true = truth(1.0)
    device = true - START + 1_000_000_000
    device[5:9] = 0
    found = restamped("/imu", columns(device, true), Stamps.DEVICE, Counter())
    assert np.flatnonzero(found.stamps == 0).tolist() == [5, 6, 7, 8]
    np.testing.assert_array_equal(
        np.delete(found.stamps, slice(5, 9)), np.delete(true, slice(5, 9))
    )


def test_one_message_and_none_are_no_error() -> None:
    for size in (0, 1):
        given = columns(np.full(size, 7, dtype=np.int64), truth()[:size])
        found = restamped("/imu", given, Stamps.DEVICE, Counter())
        np.testing.assert_array_equal(found.stamps, truth()[:size])


def recorded(path: Path, header: Callable[[int], int]) -> Path:
    """Write an IMU whose header stamps are those of `header` of the recorder's time [ns]."""
    types = STORE.types
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        imu = writer.add_connection("/imu/data_raw", IMU, typestore=STORE)
        for at in truth(1.0).tolist():
            time = types["builtin_interfaces/msg/Time"](*divmod(header(at), 10**9))
            zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=9.81)
            turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
            head = types["std_msgs/msg/Header"](stamp=time, frame_id="")
            message = types[IMU](head, turn, np.zeros(9), zero, np.zeros(9), zero, np.zeros(9))
            writer.write(imu, at, STORE.serialize_cdr(message, IMU))
    return path


def test_a_recording_without_stamps_is_read_by_its_arrivals(tmp_path: Path) -> None:
    path = recorded(tmp_path / "bag", lambda at: 0)
    with pytest.raises(RecordingError, match="arrival takes the time of recording"):
        read_recording(path)
    recording = read_recording(path, TopicNames(stamps=Stamps.ARRIVAL))
    np.testing.assert_array_equal(recording.imu.stamps, truth(1.0))
    assert recording.repairs == {"/imu/data_raw: stamped with the time of recording": 200}


def test_a_recording_with_stamps_of_a_device_is_moved(tmp_path: Path) -> None:
    path = recorded(tmp_path / "bag", lambda at: at - START + 5_000_000)
    recording = read_recording(path, TopicNames(stamps=Stamps("device")))
    np.testing.assert_array_equal(recording.imu.stamps, truth(1.0))


def test_an_unknown_clock_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="header, arrival, device"):
        TopicNames(stamps="host")  # type: ignore[arg-type]
