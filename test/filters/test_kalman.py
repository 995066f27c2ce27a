"""The Kalman filters against filterpy and against the equations of each paper."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st

from twbr_estimation.filters import Filter, filter_named
from twbr_estimation.filters.kalman_recursion import advance, reset, steady_state_matrices
from twbr_estimation.samples import CorrectedSample, TiltEstimate

Motion = Callable[..., list[CorrectedSample]]
VALUES = {"q1": 4e-6, "q2": 1e-11, "r": 2e-4, "first_tilt_gain": 0.02, "first_bias_gain": -0.003}
TILT_NOISE: dict[str, Callable[[float, float], float]] = {
    "kalman": lambda q1, dt: q1 * dt**2,
    "kalman_printed": lambda q1, dt: q1 * dt,
    "kalman_tuned": lambda q1, dt: q1,
}


def start(entry: Filter, first: CorrectedSample, values: dict[str, float]) -> tuple[Any, Any]:
    parameters = entry.configure(values)
    return entry.reset(TiltEstimate(first.angle, first.gyro_y), first, parameters), parameters


def covariance_of(state: Any) -> Any:
    return np.array(
        [[state.tilt_variance, state.covariance], [state.covariance, state.bias_variance]]
    )


@pytest.mark.parametrize("name", TILT_NOISE)
def test_against_filterpy(name: str, swinging: Motion) -> None:
    entry, samples = filter_named(name), swinging(400)
    state, parameters = start(entry, samples[0], VALUES)
    oracle = KalmanFilter(dim_x=2, dim_z=1, dim_u=1)
    oracle.x = np.array([samples[0].angle, 0.0])
    oracle.P = covariance_of(state)  # of the first prediction, so nothing is added there
    oracle.H, oracle.R = np.array([[1.0, 0.0]]), np.array([[VALUES["r"]]])
    for before, sample in pairwise(samples):
        dt = sample.dt
        first = before is samples[0]
        oracle.predict(
            u=np.array([before.gyro_y]),
            F=np.array([[1.0, -dt], [0.0, 1.0]]),
            B=np.array([[dt], [0.0]]),
            Q=np.diag([TILT_NOISE[name](VALUES["q1"], dt), VALUES["q2"]]),
        )
        if first:
            oracle.P = covariance_of(state)
        oracle.update(sample.angle)
        state = entry.step(state, sample, parameters)
        assert state.tilt == pytest.approx(oracle.x[0], abs=1e-12)
        assert state.gyro_bias == pytest.approx(oracle.x[1], abs=1e-12)
        assert state.rate == sample.gyro_y - state.gyro_bias
        np.testing.assert_allclose(covariance_of(state), oracle.P, rtol=1e-7, atol=1e-18)


@pytest.mark.parametrize("name", TILT_NOISE)
@pytest.mark.parametrize("gains", [(0.00185, -0.00018), (0.00858, -0.00007), (0.0008, 0.0)])
def test_first_gains_are_those_asked_for(
    name: str, gains: tuple[float, float], swinging: Motion
) -> None:
    entry, samples = filter_named(name), swinging(2)
    values = {"first_tilt_gain": gains[0], "first_bias_gain": gains[1]}
    state, parameters = start(entry, samples[0], values)
    assert np.linalg.eigvalsh(covariance_of(state)).min() >= -1e-20
    after = entry.step(state, samples[1], parameters)
    predicted = state.tilt + samples[1].dt * samples[0].gyro_y
    residual = samples[1].angle - predicted
    assert (after.tilt - predicted) / residual == pytest.approx(gains[0], rel=1e-9)
    assert after.gyro_bias / residual == pytest.approx(gains[1], rel=1e-9)


def test_sihite_2_with_39(swinging: Motion) -> None:
    """The complementary Kalman filter, written with matrices as printed."""
    dt = 0.005
    samples = swinging(400, dt=dt, jitter=0.0)
    entry = filter_named("kalman_tuned")
    state, parameters = start(entry, samples[0], {"q1": 1e-8, "q2": 1e-10, "r": 1e-4})
    a, b, c = np.array([[1.0, -dt], [0.0, 1.0]]), np.array([dt, 0.0]), np.array([[1.0, 0.0]])
    q_c, r_c = np.diag([1e-8, 1e-10]), 1e-4
    x, p = np.array([samples[0].angle, 0.0]), np.zeros((2, 2))
    for k in range(1, len(samples)):
        x = a @ x + b * samples[k - 1].gyro_y
        p = covariance_of(state) if k == 1 else a @ p @ a.T + q_c
        gain = (p @ c.T / (c @ p @ c.T + r_c)).ravel()
        x = x + gain * (samples[k].angle - x[0])
        p = (np.eye(2) - np.outer(gain, c)) @ p
        state = entry.step(state, samples[k], parameters)
        np.testing.assert_allclose([state.tilt, state.gyro_bias], x, rtol=0, atol=1e-12)


def test_chudzik_5_to_10(swinging: Motion) -> None:
    """Another author's symbols, the same numbers: prediction (5)-(6), correction (7)-(9)."""
    t = 0.01
    samples = swinging(400, dt=t, jitter=0.0)
    entry = filter_named("kalman_tuned")
    state, parameters = start(entry, samples[0], {"q1": 1e-6, "q2": 1e-9, "r": 3e-3})
    h_row, identity = np.array([1.0, 0.0]), np.eye(2)
    phi, g_bias = samples[0].angle, 0.0
    p_before = None
    for k in range(1, len(samples)):
        phi_prior = phi + (samples[k - 1].gyro_y - g_bias) * t  # (10) in (5)
        if p_before is None:
            p_prior = covariance_of(state)
        else:
            transition = np.array([[1.0, -t], [0.0, 1.0]])
            p_prior = transition @ p_before @ transition.T + np.diag([1e-6, 1e-9])  # (6)
        gain = p_prior @ h_row / (h_row @ p_prior @ h_row + 3e-3)  # (7)
        phi = phi_prior + gain[0] * (samples[k].angle - phi_prior)  # (8)
        g_bias = g_bias + gain[1] * (samples[k].angle - phi_prior)
        p_before = (identity - np.outer(gain, h_row)) @ p_prior  # (9)
        state = entry.step(state, samples[k], parameters)
        np.testing.assert_allclose([state.tilt, state.gyro_bias], [phi, g_bias], atol=1e-12)


@given(
    tilt_noise=st.floats(1e-12, 1e-4),
    bias_noise=st.floats(1e-10, 1e-4),
    r=st.floats(1e-6, 1e-1),
    dt=st.sampled_from([0.002, 0.005, 0.02]),
)
@settings(max_examples=25, deadline=None, derandomize=True)
def test_steady_state_gain_solves_the_riccati_equation(
    tilt_noise: float, bias_noise: float, r: float, dt: float
) -> None:
    from scipy.linalg import solve_discrete_are

    a, _, c, k = steady_state_matrices(tilt_noise, bias_noise, r, dt)
    p = solve_discrete_are(a.T, c.T, np.diag([tilt_noise, bias_noise]), np.array([[r]]))
    np.testing.assert_allclose(k, p @ c.T / (c @ p @ c.T + r), rtol=1e-4)


@pytest.mark.parametrize("name", TILT_NOISE)
def test_gain_settles_at_the_steady_state(name: str, still: Motion) -> None:
    entry, values = filter_named(name), {**VALUES, "q2": 1e-7}
    samples = still(20000, 0.005, 0.0)
    state, parameters = start(entry, samples[0], values)
    for sample in samples[1:]:
        state = entry.step(state, sample, parameters)
    kick = samples[1]._replace(angle=1.0)
    after = entry.step(state, kick, parameters)
    assert entry.matrices is not None
    gain = entry.matrices(parameters, 0.005).k.ravel()
    np.testing.assert_allclose([after.tilt, after.gyro_bias], gain, rtol=1e-6)


@given(
    steps=st.lists(st.tuples(st.floats(1e-4, 0.1), st.floats(1e-12, 1e4)), min_size=5, max_size=60),
    tilt_noise=st.floats(0.0, 1.0),
    bias_noise=st.floats(0.0, 1.0),
    first=st.tuples(st.floats(1e-6, 0.999), st.just(0.0) | st.floats(-1.0, -1e-9)),
)
@settings(max_examples=200, deadline=None, derandomize=True)
def test_covariance_stays_one(
    steps: list[tuple[float, float]],
    tilt_noise: float,
    bias_noise: float,
    first: tuple[float, float],
) -> None:
    sample = CorrectedSample(0.0, 0.1, 1e-4, *[0.0] * 15)
    gains = {"first_tilt_gain": first[0], "first_bias_gain": first[1]}
    parameters = filter_named("kalman").configure({"r": 1e-3, **gains})
    state = reset(TiltEstimate(0.1, 0.0), sample, parameters)
    for dt, r in steps:
        state = advance(state, sample._replace(dt=dt), tilt_noise, bias_noise, r)
        assert state.tilt_variance >= 0.0
        assert state.bias_variance >= 0.0
        limit = np.sqrt(state.tilt_variance * state.bias_variance)
        assert abs(state.covariance) <= limit * (1.0 + 1e-6)


def test_sample_variances_count_only_where_asked_for(swinging: Motion) -> None:
    samples = swinging(300)
    saturated = [
        *samples[:250],
        *(s._replace(angle=s.angle + 1.0, angle_variance=1e3) for s in samples[250:]),
    ]
    entry = filter_named("kalman")

    def pull(switch: float) -> float:
        """How far the saturated angles move the estimate."""
        tilts = []
        for motion in (samples, saturated):
            values = {"q1": 1e-3, "use_sample_variance": switch}
            state, parameters = start(entry, motion[0], values)
            for sample in motion[1:]:
                state = entry.step(state, sample, parameters)
            tilts.append(state.tilt)
        return abs(tilts[1] - tilts[0])

    assert pull(0.0) > 0.1
    assert pull(1.0) < 0.02
