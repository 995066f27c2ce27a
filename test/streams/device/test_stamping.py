"""Stamps by the sender, by arrival, and by a device's clock related to ours."""

from __future__ import annotations

import random

import pytest

from twbr_estimation.streams.device.stamping import Stamping, Stamps
from twbr_estimation.streams.stamps import StampGuard, Verdict

NOW = 1_700_000_000_000_000_000
MS = 1_000_000


def test_the_header_is_taken_as_it_is_and_arrival_is_the_clock() -> None:
    assert Stamping(Stamps.HEADER, "imu/data_raw").stamp(NOW - 5, NOW) == NOW - 5
    assert Stamping(Stamps.ARRIVAL, "imu/data_raw").stamp(0, NOW) == NOW


@pytest.mark.parametrize("seed", [1, 2])
def test_time_since_switched_on_becomes_time_of_this_computer(seed: int) -> None:
    draw, stamping = random.Random(seed), Stamping(Stamps.DEVICE, "imu/data_raw")
    errors = []
    for index in range(5000):
        taken = NOW + index * 4 * MS
        arrival = taken + MS + round(draw.expovariate(1.0 / (2 * MS)))
        errors.append(stamping.stamp(12_345 * MS + index * 4 * MS, arrival) - taken - MS)
    assert max(map(abs, errors[2500:])) < 0.3 * MS
    assert not stamping.counts()


def test_repeated_and_late_stamps_stay_so() -> None:
    stamping, guard = Stamping(Stamps.DEVICE, "imu/data_raw"), StampGuard()
    verdicts = [
        guard.check(stamping.stamp(header * MS, NOW + arrival * MS))
        for header, arrival in ((1000, 0), (1004, 4), (1004, 5), (1002, 6), (1008, 8))
    ]
    take, skip = Verdict.TAKE, Verdict.SKIP
    assert verdicts == [take, take, skip, skip, take]
    assert guard.counts == {"repeated_stamp": 1, "late_stamp": 1}


def test_a_device_that_restarts_is_related_again() -> None:
    stamping = Stamping(Stamps.DEVICE, "imu/data_raw")
    stamping.stamp(60_000 * MS, NOW)
    stamping.stamp(60_004 * MS, NOW + 4 * MS)
    assert stamping.stamp(100 * MS, NOW + 3000 * MS) == NOW + 3000 * MS
    assert stamping.counts() == {"clock_restarts": 1}


@pytest.mark.parametrize("stamps", [Stamps.HEADER, Stamps.DEVICE])
def test_a_stamp_of_zero_explains_itself(stamps: Stamps) -> None:
    stamping = Stamping(stamps, "imu/data_raw")
    assert stamping.stamp(0, NOW) == 0
    assert "stamps: arrival" in stamping.problem


def test_a_time_since_switched_on_explains_itself() -> None:
    stamping = Stamping(Stamps.HEADER, "joint_states")
    stamping.stamp(37_000 * MS, NOW)
    ((name, text),) = stamping.remark(NOW).items()
    assert "joint_states" in name and "stamps: device" in text
    assert not stamping.remark(40_000 * MS), "under a simulated clock it is right"


@pytest.mark.parametrize(
    ("offset", "text"),
    [
        (3000 * MS, "3.0 s ahead of this computer's clock; stamps: device"),
        (-(NOW - 5000 * MS), "counts from a start of the sender; stamps: device"),
        (500 * MS, ""),
        (-3000 * MS, ""),
    ],
)
def test_stamps_of_another_clock_are_remarked(offset: int, text: str) -> None:
    stamping = Stamping(Stamps.HEADER, "imu/data_raw")
    stamping.stamp(NOW + offset, NOW)
    assert text in stamping.remark(NOW).get("stamps of imu/data_raw", "")
    assert bool(stamping.remark(NOW)) is bool(text)
    related = Stamping(Stamps.DEVICE, "imu/data_raw")
    related.stamp(NOW + offset, NOW)
    assert not related.remark(NOW)
