"""Decoded columns against rosbags' serialisation, an independent implementation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from twbr_estimation.bags.decoding import (
    ACCEL_COLUMNS,
    GYRO_COLUMNS,
    ORIENTATION_COLUMNS,
    decode_float64_array,
    decode_imu,
    decode_temperature,
)
from twbr_estimation.bags.encoding import (
    float64_array_messages,
    joint_state_messages,
    temperature_messages,
)
from twbr_estimation.bags.joint_states import decode_joint_state
from twbr_estimation.bags.message_batch import joined
from twbr_estimation.ros_messages import tilt_of_quaternion

STORE = get_typestore(Stores.ROS2_JAZZY)
NUMBERS = st.floats(allow_nan=False, width=64)
FRAMES = st.sampled_from(["", "i", "imu_link", "base_link/µ"])


def header(nanoseconds: int, frame: str) -> Any:
    time = STORE.types["builtin_interfaces/msg/Time"](*divmod(nanoseconds, 10**9))
    return STORE.types["std_msgs/msg/Header"](time, frame)


def serialised(message: Any, little_endian: bool = True) -> bytes:
    kind = message.__msgtype__
    return bytes(STORE.serialize_cdr(message, kind, little_endian=little_endian))


def imu(nanoseconds: int, frame: str, numbers: list[float]) -> Any:
    vector, quaternion = (STORE.types[f"geometry_msgs/msg/{n}"] for n in ("Vector3", "Quaternion"))
    return STORE.types["sensor_msgs/msg/Imu"](
        header(nanoseconds, frame),
        quaternion(*numbers[:4]),
        np.arange(9.0),
        vector(*numbers[4:7]),
        np.arange(9.0) + 10,
        vector(*numbers[7:10]),
        np.arange(9.0) + 20,
    )


IMU_MESSAGES = st.lists(
    st.tuples(
        st.integers(0, 2**31 * 10**9 - 1), FRAMES, st.lists(NUMBERS, min_size=10, max_size=10)
    ),
    min_size=1,
    max_size=8,
)


@settings(max_examples=50, deadline=None)
@given(IMU_MESSAGES, st.booleans())
def test_imu(messages: list[tuple[int, str, list[float]]], little_endian: bool) -> None:
    raw = [serialised(imu(*entry), little_endian) for entry in messages]
    columns = decode_imu(joined(raw, np.arange(len(raw))))
    numbers = np.array([entry[2] for entry in messages])
    assert columns.stamps.tolist() == [entry[0] for entry in messages]
    assert columns.frames.tolist() == [entry[1] for entry in messages]
    np.testing.assert_array_equal(columns.values[:, ORIENTATION_COLUMNS], numbers[:, :4])
    np.testing.assert_array_equal(columns.values[:, GYRO_COLUMNS], numbers[:, 4:7])
    np.testing.assert_array_equal(columns.values[:, ACCEL_COLUMNS], numbers[:, 7:])
    assert columns.broken == 0


JOINTS = st.lists(
    st.sampled_from(["tilt", "left_wheel_joint", "arm", "", "x"]), unique=True, max_size=4
)


@st.composite
def joint_states(draw: st.DrawFn) -> tuple[list[str], list[float], list[float]]:
    names = draw(JOINTS)
    numbers = st.lists(NUMBERS, min_size=len(names), max_size=len(names))
    return names, draw(numbers), draw(st.one_of(st.just([]), numbers))


@settings(max_examples=100, deadline=None)
@given(st.lists(joint_states(), min_size=1, max_size=8), FRAMES, st.booleans())
def test_joint_states_of_any_layout(
    messages: list[tuple[list[str], list[float], list[float]]], frame: str, little_endian: bool
) -> None:
    kind = STORE.types["sensor_msgs/msg/JointState"]
    raw = [
        serialised(
            kind(header(i, frame), names, np.array(position), np.array(velocity), np.ones(i % 3)),
            little_endian,
        )
        for i, (names, position, velocity) in enumerate(messages)
    ]
    columns = decode_joint_state(joined(raw, np.arange(len(raw))), ("tilt", "x"))
    expected = [
        (i, [lookup(entry, joint) for joint in ("tilt", "x")])
        for i, entry in enumerate(messages)
        if {"tilt", "x"} & set(entry[0])
    ]
    assert columns.stamps.tolist() == [i for i, _ in expected]
    rows = [[*map(first, pairs), *map(second, pairs)] for _, pairs in expected]
    np.testing.assert_array_equal(columns.values, np.array(rows).reshape(-1, 4))
    assert columns.names == {name for names, _, _ in messages for name in names}


def lookup(entry: tuple[list[str], list[float], list[float]], joint: str) -> tuple[float, float]:
    names, position, velocity = entry
    if joint not in names:
        return np.nan, np.nan
    place = names.index(joint)
    return position[place], velocity[place] if velocity else np.nan


def first(pair: tuple[float, float]) -> float:
    return pair[0]


def second(pair: tuple[float, float]) -> float:
    return pair[1]


def test_more_layouts_than_are_shared() -> None:
    kind = STORE.types["sensor_msgs/msg/JointState"]
    raw = [
        serialised(
            kind(header(i, f"frame{i}"), ["tilt"], np.array([float(i)]), np.array([]), np.array([]))
        )
        for i in range(100)
    ]
    columns = decode_joint_state(joined(raw, np.arange(100)), ("tilt",))
    np.testing.assert_array_equal(columns.values[:, 0], np.arange(100))
    assert columns.frames.tolist() == [f"frame{i}" for i in range(100)]


@pytest.mark.parametrize("frame", ["", "abc", "imu_link"])
def test_what_we_write_is_what_rosbags_writes(frame: str) -> None:
    stamps = np.array([0, 1_700_000_000_123_456_789])
    kind = STORE.types["sensor_msgs/msg/Temperature"]
    expected = [serialised(kind(header(int(s), frame), 20.5, 0.0)) for s in stamps]
    assert temperature_messages(stamps, np.array([20.5, 20.5]), frame) == expected
    columns = decode_temperature(joined(expected, stamps))
    np.testing.assert_array_equal(columns.values, [[20.5], [20.5]])


@pytest.mark.parametrize("names", [("tilt",), ("left_wheel_joint", "right_wheel_joint")])
@pytest.mark.parametrize("with_velocity", [False, True])
def test_joint_states_are_written_like_rosbags_writes_them(
    names: tuple[str, ...], with_velocity: bool
) -> None:
    position = np.arange(1.0, 1.0 + len(names))
    velocity = -position if with_velocity else np.array([])
    kind = STORE.types["sensor_msgs/msg/JointState"]
    expected = serialised(kind(header(5, ""), list(names), position, velocity, np.array([])))
    (got,) = joint_state_messages(
        np.array([5]), names, position[None], velocity[None] if with_velocity else None
    )
    assert got == expected


@pytest.mark.parametrize("tilt", [-3.0, -1.0, 0.0, 0.3, 2.0])
@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_tilt_is_the_pitch_whatever_the_heading(tilt: float, yaw: float) -> None:
    cy, sy, cp, sp = np.cos(yaw / 2), np.sin(yaw / 2), np.cos(tilt / 2), np.sin(tilt / 2)
    quaternion = -sy * sp, cy * sp, sy * cp, cy * cp
    assert tilt_of_quaternion(*quaternion) == pytest.approx(tilt)
    assert tilt_of_quaternion(*(-2.0 * q for q in quaternion)) == pytest.approx(tilt)


def test_tilt_with_roll_is_what_the_accelerometer_shows() -> None:
    random = np.random.default_rng(1)
    x, y, z, w = random.normal(size=(4, 100))
    length = np.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / length, y / length, z / length, w / length
    up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    np.testing.assert_allclose(np.linalg.norm(up, axis=0), 1.0)
    np.testing.assert_allclose(tilt_of_quaternion(x, y, z, w), np.arctan2(-up[0], up[2]))


def float64_array(values: list[float], labels: tuple[str, ...] = (), little: bool = True) -> bytes:
    kinds = {
        name: STORE.types[f"std_msgs/msg/MultiArray{name}"] for name in ("Dimension", "Layout")
    }
    layout = kinds["Layout"]([kinds["Dimension"](label, 2, 2) for label in labels], 0)
    message = STORE.types["std_msgs/msg/Float64MultiArray"](layout, np.array(values))
    return serialised(message, little)


@pytest.mark.parametrize("little", [True, False])
def test_arrays_with_and_without_dimensions(little: bool) -> None:
    both = float64_array([1.5, -2.5], (), little)
    raw = [
        both,
        float64_array([3.0, 4.0], ("motors",), little),
        float64_array([5.0], ("a", "of wheels"), little),
        float64_array([], (), little),
        float64_array([6.0, 7.0, 8.0], (), little),
        both[:-8],
    ]
    columns = decode_float64_array(joined(raw, np.arange(6)))
    expected = [[2.0, 1.5, -2.5], [2.0, 3.0, 4.0], [1.0, 5.0, np.nan], [3.0, 6.0, 7.0]]
    np.testing.assert_array_equal(columns.values, expected)
    np.testing.assert_array_equal(columns.stamps, [0, 1, 2, 4])
    assert columns.broken == 2


def test_arrays_are_written_like_rosbags_writes_them() -> None:
    values = np.array([[1.0, 2.0], [-3.0, 4.0]])
    assert float64_array_messages(values) == [float64_array(row.tolist()) for row in values]
