"""The two filters of the paper's outlook: adaptive, and extended by the gyro's gain."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from twbr_estimation.filters import filter_named
from twbr_estimation.filters.kalman_recursion import advance
from twbr_estimation.samples import TiltEstimate

ADAPTIVE, EXTENDED = filter_named("kalman_adaptive"), filter_named("kalman_extended")


def run(entry, samples, **values):
    parameters = entry.configure(values)
    state = entry.reset(TiltEstimate(samples[0].angle, samples[0].gyro_y), samples[0], parameters)
    for sample in samples[1:]:
        state = entry.step(state, sample, parameters)
    return state


def test_the_adaptive_filter_is_the_recursion_with_the_matched_variance(swinging):
    samples = swinging(50)
    parameters = ADAPTIVE.configure()
    before = run(ADAPTIVE, samples[:-1])
    last = samples[-1]
    innovation = last.angle - before.tilt - last.dt * (samples[-2].gyro_y - before.gyro_bias)
    share = last.dt / (parameters.memory + last.dt)
    square = (1.0 - share) * before.innovation_square + share * innovation**2
    after = ADAPTIVE.step(before, last, parameters)
    assert after.innovation_square == pytest.approx(square, rel=1e-12)
    expected = advance(
        before.recursion,
        last,
        parameters.rate_noise**2 * last.dt,
        parameters.bias_drift**2 * last.dt,
        max(square - before.tilt_variance, last.angle_variance),
    )
    np.testing.assert_allclose(after.recursion, expected, rtol=1e-9)


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_the_adaptive_filter_learns_the_variance_of_the_angle(swinging, factor):
    state = run(ADAPTIVE, swinging(20_000, noise=factor), memory=5.0, rate_noise=1e-3)
    learned = state.innovation_square - state.tilt_variance
    assert math.sqrt(learned) == pytest.approx(factor * 0.02, rel=0.1)


def test_a_shock_is_distrusted_in_the_sample_that_brings_it(swinging):
    samples = swinging(2000, noise=0.2)
    parameters = ADAPTIVE.configure()
    state = run(ADAPTIVE, samples[:-1])

    def moved(by: float) -> float:
        shocked = samples[-1]._replace(angle=state.tilt + by)
        still = samples[-1]._replace(angle=state.tilt)
        one, other = (ADAPTIVE.step(state, each, parameters) for each in (shocked, still))
        return one.tilt - other.tilt

    assert moved(1.0) < 10.0 * moved(0.01)


def test_the_extended_filter_is_the_matrix_form(swinging):
    samples = swinging(300)
    parameters = EXTENDED.configure()
    state = run(EXTENDED, samples)
    x = np.array([samples[0].angle, 0.0, 0.0])
    p = np.diag([parameters.first_tilt**2, parameters.bias**2, parameters.gain**2])
    drifts = (parameters.rate_noise, parameters.bias_drift, parameters.gain_drift)
    for last, now in pairwise(samples):
        turn = now.dt * 0.5 * (last.gyro_y + now.gyro_y)
        a = np.array([[1.0, -now.dt, turn], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        x = a @ x + np.array([turn, 0.0, 0.0])
        p = a @ p @ a.T + np.diag(np.square(drifts)) * now.dt
        r = max(parameters.angle_noise**2, now.angle_variance)
        k = p[:, 0] / (p[0, 0] + r)
        x = x + k * (now.angle - x[0])
        p = p - np.outer(k, p[0])
    np.testing.assert_allclose([state.tilt, state.gyro_bias, state.gyro_gain], x, rtol=1e-9)
    found = [
        [state.tilt_variance, state.tilt_bias, state.tilt_gain],
        [state.tilt_bias, state.bias_variance, state.bias_gain],
        [state.tilt_gain, state.bias_gain, state.gain_variance],
    ]
    np.testing.assert_allclose(found, p, rtol=1e-7, atol=1e-15)


def test_the_extended_filter_learns_a_gyro_that_reads_low(swinging):
    low = [each._replace(gyro_y=0.95 * each.gyro_y + 0.01) for each in swinging(15_000)]
    state = run(EXTENDED, low, angle_noise=0.02, rate_noise=1e-3)
    assert 0.95 * (1.0 + state.gyro_gain) == pytest.approx(1.0, abs=0.005)
    assert state.gyro_bias == pytest.approx(0.01 / 0.95, abs=0.003)
