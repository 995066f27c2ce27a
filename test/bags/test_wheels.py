"""Joint names and messages of wheels that are not as expected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from twbr_estimation.bags import TopicNames, read_recording
from twbr_estimation.errors import ConfigurationError, RecordingError

STORE = get_typestore(Stores.ROS2_JAZZY)
IMU, JOINT_STATE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
Joints = tuple[Sequence[str], Sequence[float], Sequence[float]]
"""Names, positions, velocities."""


def write(path: Path, wheels: Sequence[Joints]) -> Path:
    """Write an IMU message and a JointState for each of `wheels`, 10 ms apart."""
    types = STORE.types
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        imu = writer.add_connection("/imu/data_raw", IMU, typestore=STORE)
        joints = writer.add_connection("/joint_states", JOINT_STATE, typestore=STORE)
        for index, (names, *numbers) in enumerate(wheels):
            stamp = types["builtin_interfaces/msg/Time"](sec=100, nanosec=index * 10_000_000)
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
            zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
            turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
            raw = types[IMU](header, turn, np.zeros(9), zero, np.zeros(9), zero, np.zeros(9))
            state = types[JOINT_STATE](header, list(names), *map(np.array, numbers), np.zeros(0))
            writer.write(imu, 10**10 + index, STORE.serialize_cdr(raw, IMU))
            writer.write(joints, 10**10 + index, STORE.serialize_cdr(state, JOINT_STATE))
    return path


def test_names_may_stand_in_any_order(tmp_path: Path) -> None:
    names = ("left_wheel_joint", "right_wheel_joint", "arm")
    wheels = [(names[:: (-1) ** i], [1.0 + i, -1.0 - i, 9.0][:: (-1) ** i], []) for i in range(10)]
    track = read_recording(write(tmp_path / "bag", wheels)).wheels
    assert track is not None
    np.testing.assert_array_equal(track.angle, [[1.0 + i, -1.0 - i] for i in range(10)])


def test_wheels_that_never_share_a_message_leave_one_wheel(tmp_path: Path) -> None:
    names = ("left_wheel_joint", "right_wheel_joint")
    wheels = [([names[i % 2]], [float(i)], []) for i in range(20)]
    recording = read_recording(write(tmp_path / "bag", wheels))
    assert recording.wheels is not None
    np.testing.assert_array_equal(recording.wheels.angle, np.arange(0.0, 20.0, 2.0)[:, None])
    why = "messages without left_wheel_joint dropped; no message holds both wheels"
    assert recording.repairs == {f"/joint_states: {why}": 10}


def test_a_joint_without_readings_is_distinguished_from_an_absent_one(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", [(["left_wheel_joint", "right_wheel_joint"], [], [])])
    with pytest.raises(RecordingError, match="neither position nor velocity of left"):
        read_recording(path)
    with pytest.raises(RecordingError, match=r"has no joint a or b.*left_wheel_joint"):
        read_recording(path, TopicNames(wheel_joints=("a", "b")))


def test_velocities_alone_are_integrated_and_said(tmp_path: Path) -> None:
    names = ("left_wheel_joint", "right_wheel_joint")
    speed = [3.0 * np.sin(0.02 * i) for i in range(400)]
    path = write(tmp_path / "bag", [(names, [], [each, -each]) for each in speed])
    recording = read_recording(path)
    assert recording.wheels is not None
    exact = 3.0 / 2.0 * (1.0 - np.cos(0.02 * np.arange(400)))
    np.testing.assert_allclose(recording.wheels.angle[:, 0], exact, atol=1e-3 * 1.5)
    np.testing.assert_array_equal(recording.wheels.angle[:, 1], -recording.wheels.angle[:, 0])
    assert recording.repairs == {"/joint_states: wheel angles integrated from velocities": 400}


@pytest.mark.parametrize("joints", [("a", "b", "c"), ("a", "a"), ("",), ()])
def test_wheel_joints_are_one_or_two_names(joints: tuple[str, ...]) -> None:
    with pytest.raises(ConfigurationError, match=r"topics\.wheel_joints"):
        TopicNames(wheel_joints=joints)


def test_wheels_that_are_no_numbers_are_named(tmp_path: Path) -> None:
    names = ("left_wheel_joint", "right_wheel_joint")
    path = write(tmp_path / "bag", [(names, [np.nan, np.nan], [])] * 5)
    with pytest.raises(RecordingError, match=r"left_wheel_joint.*no numbers in every message"):
        read_recording(path)
    assert read_recording(path, TopicNames(joint_states="")).wheels is None
