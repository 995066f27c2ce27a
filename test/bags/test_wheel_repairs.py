"""Wrapped angles go on, readings that jump away are dropped, drives stay as they are."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from twbr_estimation.bags.wheel_repairs import COUNTERS, modulus_of, spikes
from twbr_estimation.bags.wheel_tracks import repaired_wheels
from twbr_estimation.recording import WheelTrack

COUNT = 2.0 * math.pi / 1320


def drive(seed: int, rate: float, seconds: float = 60.0, speed: float = 12.0) -> WheelTrack:
    """Return a wheel that rolls to and fro, with an encoder's counts, jitter and a gap."""
    random = np.random.default_rng(seed)
    stamps = np.cumsum(random.uniform(0.8, 1.2, int(seconds * rate)) / rate * 1e9).astype(np.int64)
    stamps = np.delete(stamps, slice(stamps.size // 2, stamps.size // 2 + int(rate)))
    time = stamps * 1e-9
    angle = speed / 0.7 * (1.0 - np.cos(0.7 * time)) + 0.3 * np.sin(9.0 * time) + 0.2 * time
    return WheelTrack(stamps, np.round(angle / COUNT)[:, None] * COUNT)


def repaired(wheels: WheelTrack) -> tuple[WheelTrack, Counter[str]]:
    repairs: Counter[str] = Counter()
    return repaired_wheels("/joint_states", wheels, repairs), repairs


@pytest.mark.parametrize("rate", [20.0, 50.0, 200.0, 1000.0])
@pytest.mark.parametrize("seed", range(4))
def test_an_ordinary_drive_is_left_alone(seed: int, rate: float) -> None:
    for speed in (0.02, 1.0, 25.0):
        wheels = drive(seed, rate, speed=speed)
        same, repairs = repaired(wheels)
        assert same is wheels and not repairs


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize("low", [0.0, -math.pi, -2.0])
@pytest.mark.parametrize("modulus", [2.0 * math.pi, 4.0 * math.pi])
def test_an_angle_within_turns_goes_on(rate: float, low: float, modulus: float) -> None:
    wheels = drive(1, rate)
    wrapped = WheelTrack(wheels.stamps, np.mod(wheels.angle - low, modulus) + low)
    track, repairs = repaired(wrapped)
    gap = int(np.argmax(np.diff(wheels.stamps)))
    for part in (slice(0, gap), slice(gap + 2, None)):
        np.testing.assert_allclose(np.ptp(track.angle[part] - wheels.angle[part]), 0.0, atol=1e-9)
    assert list(repairs) == [f"/joint_states: wheel angle wraps at {modulus:.6g} rad, steps undone"]


@pytest.mark.parametrize("rate", [100.0, 500.0])
@pytest.mark.parametrize("bits", [12, 16, 20])
@pytest.mark.parametrize("signed", [True, False])
def test_a_counter_goes_on_whatever_its_bits(rate: float, bits: int, signed: bool) -> None:
    wheels = drive(2, rate)
    counts = np.round(wheels.angle[:, 0] / wheels.angle.max() * 3.3 * 2**bits)
    low = -(2 ** (bits - 1)) if signed else 0
    wrapped = np.mod(counts - low, 2**bits) + low
    assert modulus_of(wheels.stamps, wrapped, COUNTERS, 0.0) == 2**bits


def test_a_range_without_a_name_is_found_from_its_steps() -> None:
    wheels = drive(3, 500.0)
    modulus = 65536 * 2.0 * math.pi / 13200
    wrapped = WheelTrack(wheels.stamps, np.mod(wheels.angle, modulus))
    track, repairs = repaired(wrapped)
    assert np.abs((track.angle - wheels.angle) - (track.angle - wheels.angle)[0]).max() < 0.05
    assert len(repairs) == 1


@pytest.mark.parametrize("height", [3e5, -40.0, 1.5])
@pytest.mark.parametrize("length", [1, 2, 4])
def test_readings_that_jump_away_and_back_are_dropped(height: float, length: int) -> None:
    wheels = drive(4, 500.0)
    damaged = wheels.angle.copy()
    starts = np.arange(700, wheels.stamps.size - 20, 511)
    away = (starts[:, None] + np.arange(length)).ravel()
    damaged[away] += height
    track, repairs = repaired(WheelTrack(wheels.stamps, damaged))
    np.testing.assert_array_equal(track.angle, np.delete(wheels.angle, away, axis=0))
    why = "/joint_states: wheel readings that jump away and back dropped"
    assert repairs == {why: away.size}


def test_spikes_and_wraps_together_are_both_mended() -> None:
    wheels = drive(5, 500.0)
    damaged = np.mod(wheels.angle, 2.0 * math.pi)
    starts = np.arange(700, wheels.stamps.size - 20, 511)
    damaged[starts] = 1e4
    track, repairs = repaired(WheelTrack(wheels.stamps, damaged))
    kept = np.delete(wheels.angle, starts, axis=0)
    half = kept.shape[0] // 3
    np.testing.assert_allclose(np.ptp(track.angle[:half] - kept[:half]), 0.0, atol=1e-9)
    assert len(repairs) == 2


def test_a_wheel_that_starts_from_rest_is_no_spike() -> None:
    stamps = np.arange(0, 4_000_000_000, 2_000_000)
    angle = np.zeros(stamps.size)
    time = stamps[1000:1200] * 1e-9 - 2.0
    angle[1000:1200] = 0.5 * 400.0 * np.minimum(time, 0.1) ** 2
    angle[1200:] = angle[1199]
    assert not spikes(stamps, np.round(angle / COUNT) * COUNT).any()
