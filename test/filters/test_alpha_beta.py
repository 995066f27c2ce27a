"""The alpha-beta family against eq. (22) written with matrices, filterpy, and one another."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from filterpy.gh import GHFilter

from twbr_estimation.filters import filter_named
from twbr_estimation.samples import CorrectedSample, TiltEstimate

Motion = Callable[..., list[CorrectedSample]]
DT = 0.002


def run(name: str, samples: list[CorrectedSample], values: dict[str, float]) -> list[Any]:
    entry = filter_named(name)
    parameters = entry.configure(values)
    first = samples[0]
    state = entry.reset(TiltEstimate(first.angle, first.gyro_y), first, parameters)
    states = [state]
    for sample in samples[1:]:
        state = entry.step(state, sample, parameters)
        states.append(state)
    return states


MATRIX_FORMS = {
    # name: (values, states of eq. (22), whether the gyro is an output, whether it is the input)
    "alpha_beta_wob": ({}, ("tilt", "rate"), True, False),
    "alpha_beta_wb": ({}, ("tilt", "gyro_bias"), False, True),
    "alpha_beta_classic": ({}, ("tilt", "rate"), False, False),
    "alpha_beta_theta_gamma": (
        {"beta": -0.004, "theta": -0.04, "gamma": 1.5},
        ("tilt", "tracked_rate"),
        True,
        False,
    ),
    "alpha_beta_theta_wa_a": ({"theta": 0.001}, ("tilt", "rate", "acceleration"), True, False),
    "alpha_beta_theta_wa_b": ({}, ("tilt", "rate", "acceleration"), True, False),
}


@pytest.mark.parametrize("name", MATRIX_FORMS)
def test_step_is_equation_22(name: str, swinging: Motion) -> None:
    values, names, has_gyro_output, has_input = MATRIX_FORMS[name]
    samples = swinging(300, jitter=0.0)
    entry = filter_named(name)
    assert entry.matrices is not None
    a, b, c, k = entry.matrices(entry.configure(values), DT)
    states = np.array([[getattr(state, n) for n in names] for state in run(name, samples, values)])
    x = states[0]
    for before, sample, ours in zip(samples, samples[1:], states[1:], strict=False):
        y = np.array([sample.angle, sample.gyro_y] if has_gyro_output else [sample.angle])
        u = np.array([before.gyro_y] if has_input else [])
        x = (a - k @ c @ a) @ x + (b - k @ c @ b) @ u + k @ y  # (22)
        np.testing.assert_allclose(ours, x, rtol=1e-9, atol=1e-9)


def test_classic_is_the_g_h_filter_of_filterpy(swinging: Motion) -> None:
    samples = swinging(500, jitter=0.0)
    values = {"alpha": 0.05, "beta": 0.002}
    oracle = GHFilter(x=samples[0].angle, dx=samples[0].gyro_y, dt=DT, g=0.05, h=0.002)
    for sample, state in zip(
        samples[1:], run("alpha_beta_classic", samples, values)[1:], strict=True
    ):
        oracle.update(sample.angle)
        assert state.tilt == pytest.approx(oracle.x, abs=1e-12)
        assert state.rate == pytest.approx(oracle.dx, abs=1e-12)


def test_wa_a_without_theta_is_wob(swinging: Motion) -> None:
    samples = swinging(500)
    wob = run("alpha_beta_wob", samples, {"alpha": 0.01, "beta": 1.4})
    wa_a = run("alpha_beta_theta_wa_a", samples, {"alpha": 0.01, "beta": 1.4, "theta": 0.0})
    np.testing.assert_allclose([s[:2] for s in wa_a], [s[:2] for s in wob], rtol=0, atol=1e-14)


def test_text_form_33_with_printed_gains_is_far_off(swinging: Motion) -> None:
    samples = swinging(5000)
    truth = np.array([sample.angle for sample in swinging(5000, noise=0.0)])
    values = {"alpha": 0.00227, "beta": 1.58242}

    def error(name: str) -> float:
        tilt = np.array([state.tilt for state in run(name, samples, values)])
        return float(np.mean((tilt - truth) ** 2))

    assert error("alpha_beta_classic") > 100.0 * error("alpha_beta_wob")


@pytest.mark.parametrize(
    ("dt", "values"),
    [
        (0.002, (0.00204, -0.00001, 1.07026, -0.00013)),
        (0.005, (0.00668, -0.00005, 1.05866, 0.00007)),
        (0.020, (0.00391, -0.00406, -0.04194, 1.87665)),
    ],
)
def test_theta_gamma_with_the_residuals_of_2023_diverges(
    dt: float, values: tuple[float, ...]
) -> None:
    alpha, beta, theta, gamma = values
    entry = filter_named("alpha_beta_theta_gamma")
    names = dict(zip(("alpha", "beta", "theta", "gamma"), values, strict=True))
    assert entry.matrices is not None
    ours = entry.matrices(entry.configure(names), dt)
    swapped = ours._replace(k=np.array([[alpha, theta * dt], [gamma, beta / dt]]))
    assert np.abs(ours.error_eigenvalues()).max() < 1.0
    assert np.abs(swapped.error_eigenvalues()).max() > 1.004


def test_theta_gamma_taken_over_in_motion_keeps_no_stale_rate(swinging: Motion) -> None:
    """Printed gains of 2 ms, a gyro that reads low; a stale rate of 1.1 rad/s costs 3 deg."""
    truth = swinging(1000, noise=0.0)
    low = [sample._replace(gyro_y=sample.gyro_y / 1.07026) for sample in truth]
    states = run("alpha_beta_theta_gamma", low, {})
    errors = [state.tilt - sample.angle for state, sample in zip(states, truth, strict=True)]
    assert np.abs(errors).max() < np.radians(0.5)
