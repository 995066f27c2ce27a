"""The complementary filters against the equations of each paper, written out here."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from twbr_estimation.filters import filter_named
from twbr_estimation.samples import CorrectedSample, TiltEstimate

Motion = Callable[..., list[CorrectedSample]]


def tilts(name: str, samples: list[CorrectedSample], values: dict[str, float]) -> Any:
    entry = filter_named(name)
    parameters = entry.configure(values)
    first = samples[0]
    state = entry.reset(TiltEstimate(first.angle, first.gyro_y), first, parameters)
    result = [state.tilt]
    for sample in samples[1:]:
        state = entry.step(state, sample, parameters)
        result.append(state.tilt)
    return np.array(result)


def test_laddach_48_with_the_integral_of_44(swinging: Motion) -> None:
    samples = swinging(500)
    t_c = 0.7
    integral = [0.0]
    estimate = [samples[0].angle]
    for s in samples[1:]:
        integral.append(integral[-1] + s.dt * s.gyro_y)  # (44)
        estimate.append(
            t_c / (s.dt + t_c) * estimate[-1]
            + s.dt / (s.dt + t_c) * s.angle
            + t_c / (s.dt + t_c) * (integral[-1] - integral[-2])
        )  # (48)
    ours = tilts("complementary", samples, {"time_constant": t_c})
    np.testing.assert_allclose(ours, estimate, rtol=0, atol=1e-12)


def test_chudzik_1_with_the_weight_of_2(swinging: Motion) -> None:
    period = 0.01
    samples = swinging(500, dt=period, jitter=0.0)
    a = 0.98
    phi = samples[0].angle
    expected = [phi]
    for s in samples[1:]:
        phi = a * (phi + s.gyro_y * period) + (1 - a) * s.angle  # (1)
        expected.append(phi)
    tau = a * period / (1 - a)  # (2)
    ours = tilts("complementary", samples, {"time_constant": tau})
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12)


def test_sun_26_27_is_the_complementary_filter_where_t_is_dt(swinging: Motion) -> None:
    period, k_1, drift = 0.005, 0.02, 0.0
    samples = swinging(500, dt=period, jitter=0.0)
    phi = samples[0].angle
    expected = [phi]
    for s in samples[1:]:
        a_priori = phi - period * drift + period * s.gyro_y  # (26)
        phi = a_priori + k_1 * (s.angle - a_priori)  # (27)
        expected.append(phi)
    simplified = tilts("kalman_simplified", samples, {"gain": k_1})
    complementary = tilts("complementary", samples, {"time_constant": period * (1 - k_1) / k_1})
    np.testing.assert_allclose(simplified, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(complementary, expected, rtol=0, atol=1e-12)


def test_sun_26_with_another_integration_time_and_drift(swinging: Motion) -> None:
    period, integration_time, k_1, drift = 0.005, 0.006, 0.02, 0.03
    samples = swinging(300, dt=period, jitter=0.0)
    entry = filter_named("kalman_simplified")
    parameters = entry.configure({"gain": k_1, "gyro_gain": integration_time / period})
    phi = samples[0].angle
    state = entry.reset(TiltEstimate(phi, 0.0, drift), samples[0], parameters)
    for s in samples[1:]:
        a_priori = phi - integration_time * drift + integration_time * s.gyro_y  # (26)
        phi = a_priori + k_1 * (s.angle - a_priori)  # (27)
        state = entry.step(state, s, parameters)
        assert state.tilt == pytest.approx(phi, abs=1e-12)
        assert state.gyro_bias == drift


def test_sihite_1(swinging: Motion) -> None:
    period, cutoff = 0.005, 4.0
    samples = swinging(500, dt=period, jitter=0.0)
    c = math.exp(-cutoff * period)
    theta = samples[0].angle
    expected = [theta]
    for before in samples[:-1]:
        theta = c * theta + before.gyro_y * period + (1 - c) * before.angle  # (1)
        expected.append(theta)
    ours = tilts("complementary_lagged", samples, {"cutoff": cutoff})
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12)


def test_sihite_37_rounds_the_weight_of_the_default_cutoff() -> None:
    default = filter_named("complementary_lagged").configure().cutoff
    assert math.exp(-default * 0.005) == pytest.approx(0.98, abs=0.0005)
