"""Stamps rebuilt from a chip's own clock."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator

import pytest

from twbr_estimation.sensors.sample_clock import SampleClock

START = 1_700_000_000_000_000_000


def _reads(
    true_period: float, seconds: float, jitter: float, seed: int
) -> Iterator[tuple[int, int, int]]:
    """Yield (samples new, host's time, index of the newest) of jittered reads at 100 Hz."""
    generator = random.Random(seed)
    taken = 0
    for tick in range(1, round(seconds / 0.01)):
        now = tick * 0.01 + generator.uniform(0.0, jitter)
        newest = int(now / true_period)
        if newest > taken:
            yield newest - taken, START + round(now * 1e9), newest
        taken = max(taken, newest)


@pytest.mark.parametrize("drift", [-0.03, 0.0, 0.01])
@pytest.mark.parametrize("seed", [1, 2])
def test_stamps_follow_a_clock_that_drifts(drift: float, seed: int) -> None:
    period = 0.001 * (1.0 + drift)
    clock = SampleClock(0.001)
    errors, stamps = [], []
    for count, now, newest in _reads(period, 20.0, 0.002, seed):
        block = clock.stamps(count, now)
        assert len(block) == count
        stamps.extend(block)
        if now - START > 10e9:
            errors.append((block[-1] - START) * 1e-9 - newest * period)
    assert all(later > earlier for earlier, later in itertools.pairwise(stamps))
    assert clock.drift == pytest.approx(drift, abs=3e-4)
    mean = sum(errors) / len(errors)
    spread = (sum((each - mean) ** 2 for each in errors) / len(errors)) ** 0.5
    # Reads jitter by 2 ms / sqrt(12) = 0.58 ms; the line through 500 of them does far less.
    assert spread < 1e-4
    assert abs(mean) < 1e-4
    assert clock.jumps == 0


def test_untrusted_reads_do_not_move_the_line() -> None:
    clock = SampleClock(0.001)
    for tick in range(1, 101):
        clock.stamps(10, START + tick * 10_000_000)
    drift = clock.drift
    block = clock.stamps(10, START + 1_060_000_000, trusted=False)
    assert block[-1] == pytest.approx(START + 1_009_500_000, abs=20_000)
    assert clock.drift == drift


@pytest.mark.parametrize("jump", [-3600.0, 3600.0])
def test_a_clock_that_is_set_starts_a_new_relation(jump: float) -> None:
    clock = SampleClock(0.001)
    for tick in range(1, 11):
        clock.stamps(10, START + tick * 10_000_000)
    now = START + 110_000_000 + round(jump * 1e9)
    block = clock.stamps(10, now)
    assert clock.jumps == 1
    assert block[-1] == now - 500_000
    assert block[0] == block[-1] - 9_000_000


def test_a_small_step_back_keeps_stamps_increasing() -> None:
    clock = SampleClock(0.001)
    stamps = []
    for tick in range(1, 11):
        stamps.extend(clock.stamps(1, START + tick * 1_000_000))
    stamps.extend(clock.stamps(1, START + 11_000_000 - 90_000_000))
    assert all(later > earlier for earlier, later in itertools.pairwise(stamps))
