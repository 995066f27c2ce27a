"""Allan deviation against signals whose answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.noise import allan_curve

allantools = pytest.importorskip("allantools", reason="the extra `noise` is not installed")

PERIOD, COUNT = 0.01, 200_000


def test_white_noise_gives_its_density_as_random_walk() -> None:
    values = np.random.default_rng(1).normal(3.0, 0.2, COUNT)
    curve = allan_curve(values, PERIOD, "gyro x", "deg/s")
    assert curve.random_walk == pytest.approx(0.2 * math.sqrt(PERIOD), rel=0.05)
    assert curve.at(1.0) == pytest.approx(0.2 * math.sqrt(PERIOD), rel=0.05)
    assert curve.rate_random_walk is None
    assert curve.at(PERIOD * COUNT) is None


def test_a_walking_rate_gives_its_walk_and_the_instability_between() -> None:
    generator = np.random.default_rng(2)
    walk = np.cumsum(generator.normal(0.0, 0.03 * math.sqrt(PERIOD), COUNT))
    curve = allan_curve(walk + generator.normal(0.0, 1.0, COUNT), PERIOD, "gyro x", "deg/s")
    assert curve.random_walk == pytest.approx(0.1, rel=0.1)
    assert curve.rate_random_walk == pytest.approx(0.03, rel=0.3)
    # N^2 / tau + K^2 tau / 3 is lowest at tau = sqrt(3) N / K.
    lowest = math.sqrt(2.0 * 0.1 * 0.03 / math.sqrt(3.0))
    assert curve.bias_instability == pytest.approx(lowest / 0.664, rel=0.2)


def test_a_sensor_that_always_says_the_same_has_no_readings() -> None:
    curve = allan_curve(np.ones(2000), PERIOD, "gyro x", "deg/s")
    assert (curve.random_walk, curve.bias_instability, curve.rate_random_walk) == (None,) * 3
