"""Messages are read and filled by attribute, whatever their class."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from twbr_estimation import ros_messages
from twbr_estimation.samples import Sample


def imu() -> Any:
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0)),
        orientation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
        angular_velocity=SimpleNamespace(x=0.0, y=0.0, z=0.0),
        linear_acceleration=SimpleNamespace(x=0.0, y=0.0, z=0.0),
    )


def test_stamps_survive() -> None:
    message = imu()
    ros_messages.set_stamp(message, 1_700_000_000_123_456_789)
    assert message.header.stamp.sec == 1_700_000_000
    assert ros_messages.stamp_of(message) == 1_700_000_000_123_456_789


def test_readings_survive() -> None:
    message = imu()
    sample = Sample(0.002, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    ros_messages.set_readings(message, sample)
    assert ros_messages.sample_of(message, 0.002) == sample
    assert message.linear_acceleration.z == 6.0


@pytest.mark.parametrize("tilt", [-2.0, 0.0, 0.4, 3.0])
def test_tilt_survives(tilt: float) -> None:
    message = imu()
    ros_messages.set_tilt(message.orientation, tilt)
    assert ros_messages.tilt_of(message.orientation) == pytest.approx(tilt)
    assert math.hypot(message.orientation.y, message.orientation.w) == pytest.approx(1.0)


def test_joints_are_found_by_name() -> None:
    state = SimpleNamespace(name=["a", "b", "c"], position=[1.0, 2.0])
    assert ros_messages.joint_position(state, "b") == 2.0
    assert ros_messages.joint_position(state, "c") is None
    assert ros_messages.joint_position(state, "d") is None


def test_a_time_without_header_is_written_alike():
    time = SimpleNamespace(sec=0, nanosec=0)
    ros_messages.set_time(time, 1_700_000_000_123_456_789)
    assert (time.sec, time.nanosec) == (1_700_000_000, 123_456_789)
