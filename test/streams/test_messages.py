"""Serialised messages, against the independent implementation of rosbags."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from twbr_estimation.errors import MessageError
from twbr_estimation.ros_messages import ACCEL, GYRO
from twbr_estimation.streams.messages import (
    DiagnosticEncoder,
    ImuEncoder,
    JointStateEncoder,
    RawImuEncoder,
    decode_imu,
    decode_motor_command,
    decode_raw_imu,
    diagnostic_values,
    encode_float64,
    encode_float64s,
)
from twbr_estimation.streams.wheels import WheelDecoder

STORE = get_typestore(Stores.ROS2_JAZZY)
IMU, JOINTS = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
STAMP = 12_345_678_901
VALUES = [0.5 * index for index in range(37)]


def new(kind: str, *values: Any) -> Any:
    return STORE.types[kind](*values)


def header(frame: str) -> Any:
    return new("std_msgs/msg/Header", new("builtin_interfaces/msg/Time", 12, 345_678_901), frame)


def imu(frame: str) -> bytes:
    v = np.array(VALUES)
    vector = "geometry_msgs/msg/Vector3"
    message = new(
        IMU,
        header(frame),
        new("geometry_msgs/msg/Quaternion", *v[:4]),
        v[4:13],
        new(vector, *v[13:16]),
        v[16:25],
        new(vector, *v[25:28]),
        v[28:37],
    )
    return bytes(STORE.serialize_cdr(message, IMU))


def joints(names: list[str], positions: list[float], frame: str = "") -> bytes:
    count = np.array(positions)
    message = new(JOINTS, header(frame), names, count, count, np.array([]))
    return bytes(STORE.serialize_cdr(message, JOINTS))


@pytest.mark.parametrize("frame", ["", "a", "imu_link", "base_link", "a_long_frame_of_a_robot"])
def test_imu_in_any_frame(frame: str) -> None:
    data = imu(frame)
    assert decode_imu(data) == (STAMP, tuple(VALUES))
    readings = tuple(VALUES[GYRO : GYRO + 3] + VALUES[ACCEL : ACCEL + 3])
    assert decode_raw_imu(data) == (STAMP, readings)
    assert ImuEncoder(frame).encode(STAMP, VALUES) == data


@pytest.mark.parametrize("count", [1, 2, 3, 17])
def test_joint_states_are_written_as_others_read_them(count: int) -> None:
    names = ["filter" + "x" * index for index in range(count)]
    tilts = [0.1 * index for index in range(count)]
    data = JointStateEncoder(names).encode(STAMP, tilts, [2.0 * tilt for tilt in tilts])
    read = STORE.deserialize_cdr(data, JOINTS)
    assert (read.header.stamp.sec, read.header.stamp.nanosec) == (12, 345_678_901)
    assert read.name == names
    assert list(read.position) == tilts
    assert list(read.velocity) == [2.0 * tilt for tilt in tilts]
    assert len(read.effort) == 0


def test_wheels_are_found_among_other_joints_in_changing_layouts() -> None:
    decoder = WheelDecoder("left", "right")
    for frame in ("", "base"):
        both = decoder.decode(joints(["arm", "right", "left"], [9.0, 2.0, 1.0], frame))
        assert both == (STAMP, 1.5, 1.0, 2.0)
        assert decoder.decode(joints(["arm"], [9.0], frame)) is None
        assert decoder.decode(joints(["left"], [3.0], frame)) == (STAMP, 3.0, 0.0, 1.0)
        assert decoder.decode(joints(["arm"], [], frame)) is None
        single = joints(["wheel_joint", "arm"], [4.0, 9.0], frame)
        assert decoder.decode(single) == (STAMP, 4.0, 0.0, 1.0)


@pytest.mark.parametrize("values", [{}, {"": "", "a": "0", "rate_hz": "ü", "chip": "xyz"}])
def test_diagnostics_are_written_as_others_read_them(values: dict[str, str]) -> None:
    kind, value = "diagnostic_msgs/msg/DiagnosticArray", "diagnostic_msgs/msg/KeyValue"
    encoder = DiagnosticEncoder("robot/filter_node", "/dev/i2c-1")
    for message in ("estimating", "late"):  # the second without what the first left
        read = STORE.deserialize_cdr(encoder.encode(STAMP, b"\2", message, values), kind)
        said = "robot/filter_node", message, "/dev/i2c-1"
        pairs = [new(value, *each) for each in values.items()]
        status = new("diagnostic_msgs/msg/DiagnosticStatus", 2, *said, pairs)
        assert read == new(kind, header(""), [status])


def test_values_are_found_in_diagnostics_of_others() -> None:
    names = "DiagnosticArray", "DiagnosticStatus", "KeyValue"
    kind, status, value = (f"diagnostic_msgs/msg/{name}" for name in names)
    statuses = [
        new(status, 0, name, "ü", "", [new(value, *pair) for pair in each])
        for name, each in (
            ("a/driver", [("robot", "{}"), ("x", "robot"), ("", "y"), ("chip", '{"é": 1}')]),
            ("other", []),
            ("third", [("robots", "no"), ("robot", "")]),
        )
    ]
    data = bytes(STORE.serialize_cdr(new(kind, header("map"), statuses), kind))
    # Fast CDR leaves what its memory held between two texts.
    for each in (data, data.replace(b"robot\0\0\0", b"robot\0\x10\x20")):
        assert diagnostic_values(each, ("robot", "chip")) == [
            ("a/driver", "robot", "{}"),
            ("a/driver", "chip", '{"é": 1}'),
            ("third", "robot", ""),
        ]
    own = DiagnosticEncoder("n", "").encode(0, b"\0", "", {"robot": "1"})
    assert diagnostic_values(own, ("chip",)) == []
    for torn in (data[:-9], data[:70], data[:6], b"\0\0" + data[2:]):
        with pytest.raises(MessageError):
            diagnostic_values(torn, ("robot",))


def test_float64() -> None:
    kind = "std_msgs/msg/Float64"
    assert encode_float64(0.125) == bytes(STORE.serialize_cdr(new(kind, 0.125), kind))


def array_message(values: list[float], labels: list[str]) -> bytes:
    dimension = [new("std_msgs/msg/MultiArrayDimension", label, 2, 2) for label in labels]
    layout = new("std_msgs/msg/MultiArrayLayout", dimension, 0)
    kind = "std_msgs/msg/Float64MultiArray"
    return bytes(STORE.serialize_cdr(new(kind, layout, np.array(values)), kind))


@pytest.mark.parametrize("labels", [[], [""], ["motors"], ["a", "wheels"]])
def test_motor_commands(labels: list[str]) -> None:
    both = array_message([1.0, 4.0], labels)
    assert decode_motor_command(7, both) == (7, 2.5, 3.0, 2.0)
    assert decode_motor_command(7, array_message([-3.0], labels)) == (7, -3.0, 0.0, 1.0)
    for wrong in ([], [1.0, 2.0, 3.0], [1.0, math.nan]):
        with pytest.raises(MessageError):
            decode_motor_command(7, array_message(wrong, labels))
    for size in range(len(both)):
        with pytest.raises(MessageError):
            decode_motor_command(7, both[:size])


def test_float64s_are_written_as_others_write_them() -> None:
    assert encode_float64s([1.0, -2.0]) == array_message([1.0, -2.0], [])


@pytest.mark.parametrize("data", [b"", b"\x00\x01\x00\x00", imu("x")[:-8], b"\0\0" + imu("x")[2:]])
def test_what_is_no_imu_is_refused(data: bytes) -> None:
    with pytest.raises(MessageError):
        decode_imu(data)
    with pytest.raises(MessageError):
        decode_raw_imu(data)


def test_a_torn_joint_state_is_refused() -> None:
    whole = joints(["left", "right"], [1.0, 2.0])
    decoder = WheelDecoder("left", "right")
    for size in (0, 3, 14, 30, 50):
        with pytest.raises(MessageError):
            decoder.decode(whole[:size])
    assert decoder.decode(whole) is not None


def test_raw_imu_is_an_imu_without_orientation() -> None:
    gyro, accel = (0.1, -0.2, 0.3), (1.0, 2.0, -9.81)
    values = [0.0] * 37
    values[3], values[4] = 1.0, -1.0
    values[13:16], values[25:28] = gyro, accel
    values[16] = values[20] = values[24] = 4e-6
    values[28] = values[32] = values[36] = 1e-3
    for frame in ("imu_link", "body"):
        encoder = RawImuEncoder(frame, 4e-6, 1e-3)
        encoder.encode(STAMP - 7, accel, gyro)  # nothing of it stays
        assert encoder.encode(STAMP, gyro, accel) == ImuEncoder(frame).encode(STAMP, values)
