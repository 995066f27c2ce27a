"""Stamps of a device whose clock was never set."""

from __future__ import annotations

import itertools
import random

import pytest

from twbr_estimation.streams.device.clock import DeviceClock

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
DELAY = 0.002
"""Shortest time from sample to arrival [s]; nothing on our side can see it."""


def arrivals(
    seconds: float, drift: float, burst: float, seed: int, rate: float = 500.0
) -> list[tuple[int, int, float]]:
    """Return ticks [us], arrival [ns] and true time [s] of samples that come in bursts."""
    draw = random.Random(seed)
    found = []
    for i in range(int(seconds * rate)):
        true = i / rate
        ticks = round(true * (1.0 + drift) * 1e6) + 123_456
        sent = true + DELAY + draw.expovariate(1.0 / 0.001)
        if burst:
            sent = (sent // burst + 1.0) * burst
        found.append((ticks, START + round(sent * SECOND), true))
    return found


@pytest.mark.parametrize("drift", [0.0, 80e-6, -0.005])
@pytest.mark.parametrize("burst", [0.0, 0.016])
def test_stamps_follow_the_device_not_the_arrival(drift: float, burst: float) -> None:
    worst = []
    for seed in range(3):
        clock, errors, last = DeviceClock(1e-6, 2**32), [], 0
        for ticks, arrival, true in arrivals(60.0, drift, burst, seed):
            stamp = clock.stamp(ticks, arrival)
            assert stamp > last
            last = stamp
            if true > 15.0:
                errors.append((stamp - START) * 1e-9 - true)
        middle = sum(errors) / len(errors)
        assert -1e-5 <= middle - DELAY < 0.0025  # bursts end every 16 ms, samples come every 2
        worst.append(max(abs(error - middle) for error in errors))
        assert clock.restarts == 0
        assert clock.drift == pytest.approx(-drift / (1.0 + drift), abs=60e-6)
    assert sum(worst) / len(worst) < 0.0002


def test_a_counter_that_starts_again_goes_on() -> None:
    clock, errors = DeviceClock(1e-6, 2**16), []
    for i in range(5000):
        true = i * 0.002
        stamp = clock.stamp(round(true * 1e6) % 2**16, START + round((true + DELAY) * SECOND))
        errors.append((stamp - START) * 1e-9 - true)
    assert clock.restarts == 0
    assert max(errors) - min(errors) < 1e-4


def test_a_device_that_restarts_is_related_again() -> None:
    clock = DeviceClock(1e-6, 2**32)
    samples = arrivals(5.0, 0.0, 0.0, 1)
    for ticks, arrival, _ in samples:
        clock.stamp(ticks, arrival)
    later = samples[-1][1] + 3 * SECOND
    stamps = [clock.stamp(ticks, arrival - START + later) for ticks, arrival, _ in samples]
    assert clock.restarts == 1
    assert stamps[0] == pytest.approx(later, abs=0.01 * SECOND)
    assert all(a < b for a, b in itertools.pairwise(stamps))


def test_our_clock_set_back_does_not_turn_stamps_back() -> None:
    clock = DeviceClock(1e-6, 2**32)
    stamps = []
    for index, (ticks, arrival, _) in enumerate(arrivals(4.0, 0.0, 0.0, 1)):
        stamps.append(clock.stamp(ticks, arrival - (5 * SECOND if index > 1000 else 0)))
    assert clock.restarts == 1
    assert all(a < b for a, b in itertools.pairwise(stamps))
