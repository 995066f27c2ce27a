"""The Cramer-Rao bound where it is known: linear systems, and the rig's own statistics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cramer_rao.recursion import Jacobians, cramer_rao_of
from cramer_rao.rig import bound

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.worlds import world_named

STEPS, STATES = 25, 3


@pytest.fixture(scope="module")
def system() -> tuple[np.ndarray, list[Jacobians]]:
    """A linear system that changes with time, and what is known of its start."""
    random = np.random.default_rng(11)
    half = random.standard_normal((STATES, STATES))
    steps = []
    for _ in range(STEPS):
        f = np.eye(STATES) + 0.3 * random.standard_normal((STATES, STATES))
        noise = random.standard_normal((STATES, STATES))
        h = random.standard_normal((2, STATES))
        steps.append(Jacobians(f, 0.1 * noise @ noise.T, h, random.uniform(0.5, 2.0, 2)))
    return half @ half.T + np.eye(STATES), steps


def test_a_linear_system_s_bound_is_the_kalman_covariance(system):
    first, steps = system
    p, expected = first, []
    for f, q, h, r in steps:
        p = f @ p @ f.T + q
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + np.diag(r))
        p = p - gain @ h @ p
        expected.append(p[1, 1])
    assert cramer_rao_of(first, steps, 1).causal == pytest.approx(np.array(expected), rel=1e-9)


def test_it_is_tichavsky_s_recursion(system):
    first, steps = system
    j, expected = np.linalg.inv(first), []
    for f, q, h, r in steps:
        inverse = np.linalg.inv(q)
        d11, d12 = f.T @ inverse @ f, -f.T @ inverse
        d22 = inverse + h.T @ np.diag(1.0 / r) @ h
        j = d22 - d12.T @ np.linalg.inv(j + d11) @ d12
        expected.append(np.linalg.inv(j)[0, 0])
    assert cramer_rao_of(first, steps).causal == pytest.approx(np.array(expected), rel=1e-7)


def test_hindsight_is_the_inverse_information_of_all_states(system):
    first, steps = system
    size = STATES * (STEPS + 1)
    j = np.zeros((size, size))
    j[:STATES, :STATES] = np.linalg.inv(first)
    for k, (f, q, h, r) in enumerate(steps):
        slopes = np.zeros((STATES, size))
        slopes[:, k * STATES : (k + 1) * STATES] = -f
        slopes[:, (k + 1) * STATES : (k + 2) * STATES] = np.eye(STATES)
        j += slopes.T @ np.linalg.inv(q) @ slopes
        here = slice((k + 1) * STATES, (k + 2) * STATES)
        j[here, here] += h.T @ np.diag(1.0 / r) @ h
    expected = np.diagonal(np.linalg.inv(j)).reshape(STEPS + 1, STATES)[1:, 2]
    assert cramer_rao_of(first, steps, 2).hindsight == pytest.approx(expected, rel=1e-7)


def test_no_slip_of_the_mathematics_lets_a_known_state_be_learnt():
    """A constant without variance stays known, whatever is measured."""
    step = Jacobians(np.eye(2), np.zeros((2, 2)), np.array([[1.0, 1.0]]), np.array([1.0]))
    found = cramer_rao_of(np.diag([1.0, 0.0]), [step] * 9)
    assert found.causal == pytest.approx(1.0 / (1.0 + np.arange(1.0, 10.0)))
    assert found.hindsight == pytest.approx(np.full(9, 0.1))


def test_what_is_unknown_raises_the_rig_s_bound():
    def mean(**changes: float) -> tuple[float, float]:
        world = replace(world_named("W1"), **changes)
        found = bound(simulate(world, 0.02, 10.0, 6131))
        return float(np.mean(found.causal[100:])), float(np.mean(found.hindsight))

    causal, hindsight = mean()
    assert 0.0 < hindsight < causal
    for changes in (
        {"calibration_residual": 0.1},
        {"mounting_error_deg": 0.2},
        {"gyro_noise_deg": 0.5},
        {"gyro_drift_deg": 0.3},
    ):
        worse = mean(**changes)
        assert worse[0] > 1.05 * causal, changes
        assert worse[1] > 1.05 * hindsight, changes


def test_the_bound_is_for_the_plane():
    with pytest.raises(ConfigurationError, match="in the plane"):
        bound(simulate("W4", 0.02, 2.0, 6131))
