"""Wheels by the forward speed of nav_msgs/Odometry, live and recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from twbr_estimation import load
from twbr_estimation.bags import TopicNames, read_recording
from twbr_estimation.bags.wheel_tracks import integrated
from twbr_estimation.errors import MessageError, RecordingError
from twbr_estimation.robot import Robot, Setup
from twbr_estimation.streams.odometry import OdometryDecoder

STORE = get_typestore(Stores.ROS2_JAZZY)
ODOMETRY, IMU = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu"
SECOND = 1_000_000_000


def new(kind: str, *values: Any) -> Any:
    return STORE.types[kind](*values)


def header(stamp: int, frame: str) -> Any:
    time = new("builtin_interfaces/msg/Time", *divmod(stamp, SECOND))
    return new("std_msgs/msg/Header", time, frame)


def odometry(stamp: int, speed: float, frame: str = "odom", child: str = "base_link") -> bytes:
    point, turn = "geometry_msgs/msg/Point", "geometry_msgs/msg/Quaternion"
    pose = new("geometry_msgs/msg/Pose", new(point, 7.0, 8.0, 9.0), new(turn, 0.0, 0.0, 0.0, 1.0))
    vector = "geometry_msgs/msg/Vector3"
    linear, angular = new(vector, speed, 5.0, 6.0), new(vector, 1.0, 2.0, 3.0)
    message = new(
        ODOMETRY,
        header(stamp, frame),
        child,
        new("geometry_msgs/msg/PoseWithCovariance", pose, np.full(36, 4.0)),
        new(
            "geometry_msgs/msg/TwistWithCovariance",
            new("geometry_msgs/msg/Twist", linear, angular),
            np.full(36, 3.0),
        ),
    )
    return bytes(STORE.serialize_cdr(message, ODOMETRY))


def imu(stamp: int) -> bytes:
    still = new("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
    down = new("geometry_msgs/msg/Vector3", 0.0, 0.0, 9.81)
    turn = new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    message = new(
        IMU, header(stamp, "imu"), turn, np.full(9, -1.0), still, np.zeros(9), down, np.zeros(9)
    )
    return bytes(STORE.serialize_cdr(message, IMU))


def recorded(path: Path, stamps: list[int], messages: list[bytes]) -> Path:
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        readings = writer.add_connection("/imu/data_raw", IMU, typestore=STORE)
        speeds = writer.add_connection("/odom", ODOMETRY, typestore=STORE)
        for stamp, message in zip(stamps, messages, strict=True):
            writer.write(readings, stamp, imu(stamp))
            writer.write(speeds, stamp, message)
    return path


@pytest.mark.parametrize("frame", ["", "odom", "robot/odom"])
@pytest.mark.parametrize("child", ["", "b", "base_link", "base_footprint"])
def test_the_speed_is_found_behind_names_of_any_length(frame: str, child: str) -> None:
    decoder = OdometryDecoder(lambda: 0.05)
    decoder.decode(odometry(SECOND, 0.2, frame, child))
    reading = decoder.decode(odometry(SECOND + 10_000_000, 0.4, frame, child))
    assert reading.stamp == SECOND + 10_000_000 and reading.encoders == 1.0
    assert reading.angle == pytest.approx(0.3 * 0.01 / 0.05, abs=1e-15)
    assert decoder.rates.messages == 2


def test_the_radius_may_change_and_the_gear_divides() -> None:
    radius = [0.05]
    decoder = OdometryDecoder(lambda: radius[0], gear_ratio=2.0)
    decoder.decode(odometry(SECOND, 0.4))
    decoder.decode(odometry(SECOND + 10_000_000, 0.4))
    radius[0] = 0.1
    angle = decoder.decode(odometry(SECOND + 20_000_000, 0.4)).angle
    assert angle == pytest.approx(0.01 * 4.0 + 0.01 * 3.0, abs=1e-15)


@pytest.mark.parametrize("length", [0, 4, 12, 40, 300, 380])
def test_torn_messages_are_refused(length: int) -> None:
    with pytest.raises(MessageError, match="an Odometry of"):
        OdometryDecoder(lambda: 0.05).decode(odometry(SECOND, 0.4)[:length])


def test_a_recording_gives_the_angles_of_the_live_path(tmp_path: Path) -> None:
    stamps = (SECOND + np.cumsum(np.random.default_rng(4).integers(5, 20, 60)) * 1_000_000).tolist()
    speeds = np.sin(np.array(stamps) * 1e-9)
    lengths = ["base_link", "base"]
    messages = [
        odometry(stamp, speed, child=lengths[index % 2])
        for index, (stamp, speed) in enumerate(zip(stamps, speeds.tolist(), strict=True))
    ]
    path = recorded(tmp_path / "bag", stamps, [*messages[:-1], messages[-1][:50]])
    topics = TopicNames(joint_states="odom")
    recording = read_recording(path, topics)
    assert recording.wheels is not None and recording.wheels.is_distance
    np.testing.assert_allclose(
        recording.wheels.angle[:, 0], integrated(np.array(stamps[:-1]), speeds[:-1]), atol=1e-12
    )
    assert recording.repairs["/odom: distance rolled integrated from speeds"] == 59
    decoder = OdometryDecoder(lambda: Robot().wheel_radius)
    live = [decoder.decode(message).angle for message in messages[:-1]]
    drive = load(path, topics=topics)
    assert drive.recording.wheels is not None and not drive.recording.wheels.is_distance
    np.testing.assert_allclose(drive.recording.wheels.angle[:, 0], live, atol=1e-12)


def test_an_odometry_is_no_reference(tmp_path: Path) -> None:
    path = recorded(tmp_path / "bag", [SECOND], [odometry(SECOND, 0.0)])
    with pytest.raises(RecordingError, match="/odom is a nav_msgs/msg/Odometry; needed is"):
        read_recording(path, TopicNames(reference="/odom"))


def test_across_a_gap_the_wheels_stand_in_recordings_too() -> None:
    stamps = np.array([1000, 1010, 9000, 9010]) * 1_000_000
    assert integrated(stamps, np.full(4, 2.0)) == pytest.approx([0.0, 0.02, 0.02, 0.04])


def test_setups_keep_the_angles_of_the_first_radius(tmp_path: Path) -> None:
    """The radius that made angles of distances is not applied twice."""
    stamps = [SECOND + 10_000_000 * index for index in range(5)]
    path = recorded(tmp_path / "bag", stamps, [odometry(stamp, 0.1) for stamp in stamps])
    drive = load(path, topics=TopicNames(joint_states="odom"))
    other = drive.with_setup(Setup(Robot(wheel_radius=0.05)))
    assert drive.recording.wheels is not None and other.recording.wheels is not None
    np.testing.assert_array_equal(other.recording.wheels.angle, drive.recording.wheels.angle)
