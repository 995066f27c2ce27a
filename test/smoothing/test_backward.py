"""The backward sweep against the joint distribution of all states, solved at once."""

from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.filters.inertial.error_state import STATES
from twbr_estimation.smoothing.backward import final_state, step_back

STEPS = 6


class Linear:
    """A random linear system without control, filtered and solved at once."""

    def __init__(self, seed: int, known: int) -> None:
        """Draw it; the last `known` states have no variance at all."""
        random = np.random.default_rng(seed)
        free = STATES - known
        self.f = np.eye(STATES) + 0.2 * random.standard_normal((STATES, STATES))
        self.f[free:, :free] = 0.0
        self.noise = np.zeros((STATES, STATES))
        half = random.standard_normal((free, free))
        self.noise[:free, :free] = 0.1 * half @ half.T
        self.first = np.zeros((STATES, STATES))
        half = random.standard_normal((free, free))
        self.first[:free, :free] = half @ half.T + np.eye(free)
        self.rows = random.standard_normal((STEPS, 3, STATES))
        self.measured = random.standard_normal((STEPS, 3))

    def filtered(self) -> list[tuple[np.ndarray, ...]]:
        """Return prior, posterior, transition, found and posterior mean of each step."""
        steps, mean, p = [], np.zeros(STATES), self.first
        for k in range(STEPS):
            transition = np.eye(STATES) if k == 0 else self.f
            prior = p if k == 0 else self.f @ p @ self.f.T + self.noise
            mean, h = transition @ mean, self.rows[k]
            gain = prior @ h.T @ np.linalg.inv(h @ prior @ h.T + np.eye(3))
            found = gain @ (self.measured[k] - h @ mean)
            p = prior - gain @ h @ prior
            mean = mean + found
            steps.append((prior, p, transition, found, mean))
        return steps

    def at_once(self) -> tuple[np.ndarray, np.ndarray]:
        """Return mean (STEPS, s) and covariance (STEPS, s, s) of each state."""
        size = STEPS * STATES
        joint = np.zeros((size, size))
        p = self.first
        for k in range(STEPS):
            p = p if k == 0 else self.f @ p @ self.f.T + self.noise
            column = p
            for later in range(k, STEPS):
                a, b = slice(k * STATES, (k + 1) * STATES), later * STATES
                joint[b : b + STATES, a] = column
                joint[a, b : b + STATES] = column.T
                column = self.f @ column
        h = np.zeros((3 * STEPS, size))
        for k in range(STEPS):
            h[3 * k : 3 * k + 3, k * STATES : (k + 1) * STATES] = self.rows[k]
        gain = joint @ h.T @ np.linalg.inv(h @ joint @ h.T + np.eye(3 * STEPS))
        mean = gain @ self.measured.ravel()
        rest = joint - gain @ h @ joint
        blocks = [slice(k * STATES, (k + 1) * STATES) for k in range(STEPS)]
        return mean.reshape(STEPS, STATES), np.array([rest[b, b] for b in blocks])


@pytest.mark.parametrize("known", [0, 2])
@pytest.mark.parametrize("seed", range(3))
def test_sweep_gives_the_joint_solution(seed, known):
    system = Linear(seed, known)
    means, covariances = system.at_once()
    later = final_state()
    for k, (prior, posterior, transition, found, mean) in reversed(
        list(enumerate(system.filtered()))
    ):
        later, error = step_back(later, prior, posterior, transition, found)
        assert mean + error == pytest.approx(means[k], abs=1e-7)
        assert later.covariance == pytest.approx(covariances[k], abs=1e-7)
        assert later.found == pytest.approx(found + error)


def test_a_new_start_learns_nothing_from_later():
    system = Linear(5, 0)
    steps = system.filtered()
    prior, _, _, found, _ = steps[-1]
    later, _ = step_back(final_state(), prior, steps[-1][1], np.zeros((STATES, STATES)), found)
    _, error = step_back(later, *steps[-2][:4])
    assert np.all(error == 0.0)
