"""Wheels that report velocities alone, or turns of the motors before a gear."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from twbr_estimation.bags.wheel_tracks import integrated
from twbr_estimation.errors import MessageError
from twbr_estimation.streams.wheels import WheelDecoder

STORE = get_typestore(Stores.ROS2_JAZZY)
KIND = "sensor_msgs/msg/JointState"
SECOND = 1_000_000_000


def joints(stamp: int, names: list[str], positions: list[float], velocities: list[float]) -> bytes:
    time = STORE.types["builtin_interfaces/msg/Time"](*divmod(stamp, SECOND))
    header = STORE.types["std_msgs/msg/Header"](time, "base")
    arrays = [np.array(each, dtype=np.float64) for each in (positions, velocities, [])]
    return bytes(STORE.serialize_cdr(STORE.types[KIND](header, names, *arrays), KIND))


def test_velocities_alone_give_the_angles_of_the_offline_integration() -> None:
    decoder = WheelDecoder("left", "right")
    stamps = SECOND + np.cumsum(np.random.default_rng(3).integers(5, 20, 200)) * 1_000_000
    times = stamps * 1e-9
    left, right = 3.0 * np.sin(times), 3.0 * np.sin(times) + 0.4
    found = []
    for stamp, *rates in zip(stamps.tolist(), left.tolist(), right.tolist(), strict=True):
        reading = decoder.decode(
            joints(stamp, ["left", "arm", "right"], [], [rates[0], 9.0, rates[1]])
        )
        assert reading is not None and reading.stamp == stamp and reading.encoders == 2.0
        found.append((reading.angle, reading.difference))
    angles, differences = np.array(found).T
    expected = integrated(stamps, left), integrated(stamps, right)
    assert angles == pytest.approx(0.5 * (expected[0] + expected[1]), abs=1e-12)
    assert differences == pytest.approx(expected[1] - expected[0], abs=1e-12)
    assert decoder.rates.messages == 200


def test_across_a_gap_and_a_clock_set_back_the_wheels_stand() -> None:
    decoder = WheelDecoder("left", "right")
    angles = []
    for milliseconds in (1000, 1010, 9000, 9010, 500, 510):
        reading = decoder.decode(joints(milliseconds * 1_000_000, ["left"], [], [2.0]))
        assert reading is not None
        angles.append(reading.angle)
    assert angles == pytest.approx([0.0, 0.02, 0.02, 0.04, 0.04, 0.06])


def test_positions_rule_over_velocities_and_torn_messages_are_refused() -> None:
    decoder = WheelDecoder("left", "right")
    reading = decoder.decode(joints(SECOND, ["left", "right"], [1.0, 2.0], [5.0, 5.0]))
    assert reading == (SECOND, 1.5, 1.0, 2.0)
    assert decoder.rates.messages == 0
    whole = joints(SECOND, ["left", "right"], [], [1.0, 2.0])
    with pytest.raises(MessageError):
        decoder.decode(whole[:-16])
    assert decoder.decode(joints(SECOND, ["left", "right"], [], [])) is None


def test_a_rate_that_is_no_number_does_not_stay_in_the_angle() -> None:
    decoder = WheelDecoder("left", "right")
    angles = []
    for index, rate in enumerate((1.0, math.nan, 1.0, 1.0)):
        reading = decoder.decode(joints(SECOND + index * 10_000_000, ["left"], [], [rate]))
        assert reading is not None
        angles.append(reading.angle)
    assert math.isnan(angles[1]), "it is counted as no number"
    assert angles[2:] == pytest.approx([0.02, 0.03])


def test_turns_of_the_motors_become_those_of_the_wheels() -> None:
    decoder = WheelDecoder("left", "right", gear_ratio=30.0)
    reading = decoder.decode(joints(SECOND, ["left", "right"], [30.0, 60.0], []))
    assert reading is not None
    assert reading[1:] == pytest.approx((1.5, 1.0, 2.0))
