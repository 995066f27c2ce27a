from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.controllers import ControlInput, controller_named
from twbr_estimation.controllers.slc_sihite2018 import INNER, OUTER, resampled
from twbr_estimation.robot import Robot

ENTRY = controller_named("slc_sihite2018")


def edumip() -> tuple[np.ndarray, np.ndarray]:
    """Return (43)-(47) without yaw: tilt, wheel against body, and their rates."""
    dt = 0.005
    a = np.eye(4)
    a[0, 2] = a[1, 3] = dt
    a[2, 0], a[2, 3], a[3, 0], a[3, 3] = 0.6291, 0.0681, -1.1151, 0.8133
    return a, np.array([0.0, 0.0, -2.7233, 7.4692])


def realised(function) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return a transfer function as a, b, c, d."""
    (n0, n1, n2), (_, d1, d2) = function
    a = np.array([[-d1, -d2], [1.0, 0.0]])
    return a, np.array([1.0, 0.0]), np.array([n1 - n0 * d1, n2 - n0 * d2]), n0


def closed_loop(outer) -> np.ndarray:
    """Return the transition matrix of the paper's robot with both loops."""
    (plant, entry), (ai, bi, ci, di), (ao, bo, co, do) = edumip(), realised(INNER), realised(outer)
    total = np.zeros((8, 8))
    ahead = np.zeros(8)
    ahead[:2] = 1.0  # wheel against ground
    error = do * ahead
    error[6:] += co
    error[0] -= 1.0
    command = di * error
    command[4:6] += ci
    total[:4, :4] = plant
    total[:4] += np.outer(entry, command)
    total[4:6, 4:6] = ai
    total[4:6] += np.outer(bi, error)
    total[6:, 6:] = ao
    total[6:] += np.outer(bo, ahead)
    return total


def test_the_papers_robot_stands_with_the_loops_put_right_and_not_as_printed():
    def moduli(outer):
        return np.sort(np.abs(np.linalg.eigvals(closed_loop(outer))))[::-1]

    right = moduli(OUTER)
    assert right[0] == pytest.approx(1.0, abs=1e-9)  # the integrator that the zero cancels
    assert right[1] < 0.9999
    printed = ((-0.189, 0.372, -0.184), OUTER[1])
    assert moduli(printed)[0] > 1.01


def test_at_the_printed_period_the_loops_are_those_printed():
    for function in (INNER, OUTER):
        same = resampled(function, 0.005)
        np.testing.assert_allclose(same.numerator, function[0], rtol=1e-12)
        np.testing.assert_allclose(same.denominator, function[1], rtol=1e-12)


@pytest.mark.parametrize("period", [0.002, 0.01])
def test_at_another_period_slow_signals_pass_alike(period):
    for function in (INNER, OUTER):
        other = resampled(function, period)
        for frequency in (1.0, 5.0):
            gains = []
            for (n, d), dt in ((function, 0.005), (other, period)):
                # The bilinear rule maps tan(w dt / 2) / dt, so compare at equal tangents.
                w = 2.0 * np.arctan(frequency * dt / 2.0)
                z = np.exp(1j * w)
                gains.append(np.polyval(n, z) / np.polyval(d, z))
            assert gains[0] == pytest.approx(gains[1], rel=1e-9)


def test_yaw_follows_35():
    values = {"yaw_gain": 1.0, "yaw_rate_gain": 0.05}
    coefficients = ENTRY.derive(ENTRY.configure(values), Robot(), 0.005)
    now = ControlInput(0.005, 0.0, 0.0, 0.0, 0.0, 0.2, 0.1, 0.0, 0.0)
    state = ENTRY.reset(now, coefficients)
    turned = ENTRY.step(state, now._replace(heading=-0.3, target_yaw_rate=0.4), coefficients)
    expected = 1.0 * (0.2 + 0.4 * 0.005 + 0.3) + 0.05 * (0.4 - 0.1)
    assert 0.5 * (turned.right - turned.left) == pytest.approx(expected)
