"""Messages are read and filled by attribute, whatever their class."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from twbr_estimation import ros_messages


def imu() -> Any:
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0)),
        orientation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
    )


def test_stamps_survive() -> None:
    message = imu()
    ros_messages.set_stamp(message, 1_700_000_000_123_456_789)
    assert message.header.stamp.sec == 1_700_000_000
    assert ros_messages.stamp_of(message) == 1_700_000_000_123_456_789


@pytest.mark.parametrize("tilt", [-2.0, 0.0, 0.4, 3.0])
def test_tilt_survives(tilt: float) -> None:
    message = imu()
    ros_messages.set_tilt(message.orientation, tilt)
    assert ros_messages.tilt_of(message.orientation) == pytest.approx(tilt)
    assert math.hypot(message.orientation.y, message.orientation.w) == pytest.approx(1.0)


def test_a_time_without_header_is_written_alike():
    time = SimpleNamespace(sec=0, nanosec=0)
    ros_messages.set_time(time, 1_700_000_000_123_456_789)
    assert (time.sec, time.nanosec) == (1_700_000_000, 123_456_789)
