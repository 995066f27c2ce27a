"""What a filter node takes for an orientation, and what it leaves out."""

from __future__ import annotations

import math
import struct

import pytest

from twbr_estimation.errors import MessageError
from twbr_estimation.pipeline.physical import FASTEST, STRONGEST
from twbr_estimation.robot import Setup
from twbr_estimation.ros_messages import ACCEL, GYRO
from twbr_estimation.samples import RESTART_GAP
from twbr_estimation.streams.inputs import InputSettings
from twbr_estimation.streams.messages import ImuEncoder
from twbr_estimation.streams.tilt_input import SWITCH_AFTER, TiltInput

START = 10**12
STEP = 5_000_000
LEAN = 0.2


class Feed:
    """Serialised messages of a robot that leans, into a `TiltInput`."""

    def __init__(self) -> None:
        self.input = TiltInput(InputSettings(wheel_wait=0.0), Setup())
        self._encoder, self._stamp = ImuEncoder("imu"), START
        self.samples: list[tuple[int, object]] = []

    def message(self, oriented: float | None = None, **changed: float) -> bytes:
        values = [0.0] * 37
        values[3], values[4] = 1.0, -1.0
        if oriented is not None:
            values[1], values[3] = math.sin(oriented / 2.0), math.cos(oriented / 2.0)
            values[4] = values[8] = 1e-4
        values[ACCEL], values[ACCEL + 2] = -9.8 * math.sin(LEAN), 9.8 * math.cos(LEAN)
        for name, value in changed.items():
            values[int(name[1:])] = value
        self._stamp += STEP
        return self._encoder.encode(self._stamp, values)

    def add(self, oriented: float | None = None, count: int = 1, **changed: float) -> int:
        """Feed messages; return how many samples came out."""
        found = [self.input.add_imu(self.message(oriented, **changed)) for _ in range(count)]
        self.samples += [each for ready in found for each in ready]
        return sum(map(len, found))


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"v4": 0.0},  # the default of the message: identity, covariance of zeros
        {"v4": 0.0, "v1": math.nan},
        {"v4": 0.0, "v3": math.inf},
        {"v4": 0.0, "v3": 0.0},
        {"v4": 1e30, "v8": 1e30},
        {"v16": math.nan, "v20": 1e30, "v28": -3.0},
    ],
)
def test_an_orientation_that_is_none_is_raw(changed: dict[str, float]) -> None:
    feed = Feed()
    assert feed.add(count=50, **changed) == 50
    assert feed.input.raw
    assert feed.samples[-1][1].angle == pytest.approx(LEAN, abs=1e-3)  # type: ignore[attr-defined]


def test_an_identity_counts_once_another_orientation_has_come() -> None:
    feed = Feed()
    assert feed.add(0.1) == 1 and not feed.input.raw
    assert feed.add(count=20, v1=0.0, v3=1.0, v4=0.0) == 20 and not feed.input.raw
    assert feed.samples[-1][1].angle == 0.0  # type: ignore[attr-defined]


@pytest.mark.parametrize("first", [0.1, None])
def test_single_messages_of_the_other_kind_are_left_out(first: float | None) -> None:
    feed = Feed()
    other = None if first is not None else 0.1
    assert feed.add(first, 10) == 10
    for _ in range(5):
        assert feed.add(other, 2) == 0 and feed.add(first, 3) == 3
    assert feed.input.counts()["imu_of_the_other_kind"] == 10
    assert all(sample.dt > 0.0 for _, sample in feed.samples[1:])  # type: ignore[attr-defined]


@pytest.mark.parametrize("first", [0.1, None])
def test_a_lasting_change_of_kind_starts_afresh(first: float | None) -> None:
    feed = Feed()
    other = None if first is not None else 0.1
    feed.add(first, 10)
    assert feed.add(other, SWITCH_AFTER + 4) == 5
    assert feed.samples[10][1].dt > RESTART_GAP  # type: ignore[attr-defined]
    assert feed.add(first, SWITCH_AFTER + 4) == 5
    assert feed.samples[15][1].dt > RESTART_GAP  # type: ignore[attr-defined]


@pytest.mark.parametrize("oriented", [0.1, None])
@pytest.mark.parametrize("place", [GYRO, GYRO + 1, ACCEL, ACCEL + 2])
@pytest.mark.parametrize(
    ("value", "name"),
    [
        (math.nan, "not_finite"),
        (-math.inf, "not_finite"),
        (1e154, "beyond_any_sensor"),
        (-1e80, "beyond_any_sensor"),
        (3000.0, "beyond_any_sensor"),
    ],
)
def test_what_no_sensor_reads_is_counted_and_dropped(
    oriented: float | None, place: int, value: float, name: str
) -> None:
    feed = Feed()
    feed.add(oriented, 3)
    assert feed.add(oriented, 1, **{f"v{place}": value}) == 0
    assert feed.input.counts() == {f"imu_{name}": 1}
    assert feed.add(oriented) == 1


def test_the_largest_readings_of_sensors_pass() -> None:
    assert FASTEST > math.radians(4000.0) and STRONGEST > 100.0 * 9.81
    assert FASTEST > 500.0, "deg/s must come through to be recognised"


def test_a_stamp_beyond_its_second_is_unreadable() -> None:
    feed = Feed()
    data = bytearray(feed.message())
    struct.pack_into("<iI", data, 4, 2**31 - 1, 2**32 - 1)
    with pytest.raises(MessageError, match="4294967295 ns"):
        feed.input.add_imu(bytes(data))


@pytest.mark.parametrize("variance", [0.0, -1.0, math.nan, math.inf, 1e30])
def test_an_unknown_variance_is_replaced(variance: float) -> None:
    feed = Feed()
    feed.add(0.1, 5, v8=1e-4, v16=variance, v20=variance, v28=variance)
    sample = feed.samples[-1][1]
    assert 0.0 < sample.gyro_variance_y < 1e-3  # type: ignore[attr-defined]
    assert 0.0 < sample.accel_variance_x < 1.0  # type: ignore[attr-defined]
    assert not sample.gyro_saturated_y  # type: ignore[attr-defined]
