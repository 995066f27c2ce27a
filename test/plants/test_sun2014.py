"""Sun 2014: printed and right coefficients, and the gains that follow from each."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from scipy.linalg import solve_continuous_are

from twbr_estimation.plants.sun2014 import (
    PRINTED,
    Coefficients,
    RodParameters,
    RodState,
    accelerations,
    coefficients,
    matrices,
)

ROBOT = RodParameters()
RIGHT = coefficients(ROBOT)


def test_the_right_coefficients() -> None:
    np.testing.assert_allclose(RIGHT, [70.0, 16.3333, 11.9048, 4.4444], atol=1e-4)
    # All but A1 and B2 are what the paper prints.
    assert PRINTED.a2 == pytest.approx(RIGHT.a2, abs=1e-3)
    assert PRINTED.b1 == pytest.approx(RIGHT.b1, abs=1e-3)


@pytest.mark.parametrize(
    ("numbers", "weights", "gains"),
    [
        (PRINTED, (1, 1, 1, 1), [27.5841, 2.9604, -1.0, -1.5277]),
        (PRINTED, (100, 1, 100, 1), [44.617, 4.7724, -10.0, -5.2005]),
        (RIGHT, (1, 1, 1, 1), [16.7824, 2.6443, -1.0, -1.7958]),
        (RIGHT, (100, 1, 100, 1), [31.6556, 5.1479, -10.0, -7.3214]),
    ],
)
def test_the_gains_of_section_v(
    numbers: Coefficients, weights: tuple[int, ...], gains: list[float]
) -> None:
    a, b = matrices(numbers)
    cost = solve_continuous_are(a, b, np.diag(weights), np.eye(1))
    np.testing.assert_allclose((b.T @ cost)[0], gains, atol=5e-5)


def test_the_linear_model_is_the_tangent_of_the_other() -> None:
    a, b = matrices(RIGHT)
    random = np.random.default_rng(1)
    for row in 1e-5 * random.normal(size=(20, 5)):
        state, force = RodState(*row[:4].tolist()), float(row[4])
        angular, linear = accelerations(state, force, ROBOT)
        slopes = [state.rate, angular, state.velocity, linear]
        np.testing.assert_allclose(slopes, a @ row[:4] + b[:, 0] * force, rtol=1e-7)


def test_the_equations_of_motion_are_lagranges() -> None:
    t, u = sympy.symbols("t u")
    m, w, length, g = sympy.symbols("m w L g", positive=True)
    tilt, x = sympy.Function("tilt")(t), sympy.Function("x")(t)
    along, up = x - length * sympy.sin(tilt), length * sympy.cos(tilt)
    turning = m * length**2 / 3 * tilt.diff(t) ** 2
    moving = m * (along.diff(t) ** 2 + up.diff(t) ** 2) + 2 * w * x.diff(t) ** 2
    lagrangian = (turning + moving) / 2 - m * g * up
    equations = [
        sympy.diff(lagrangian.diff(q.diff(t)), t) - lagrangian.diff(q) - force
        for q, force in ((tilt, 0), (x, u))
    ]
    solved = sympy.solve(equations, [tilt.diff(t, 2), x.diff(t, 2)], dict=True)[0]
    random = np.random.default_rng(2)
    for row in random.normal(size=(20, 5)).tolist():
        values = [(tilt.diff(t), row[1]), (x.diff(t), row[3]), (tilt, row[0]), (u, row[4])]
        values += list(zip((m, w, length, g), ROBOT, strict=True))
        expected = [float(solved[q.diff(t, 2)].subs(values)) for q in (tilt, x)]
        found = accelerations(RodState(*row[:4]), row[4], ROBOT)
        np.testing.assert_allclose(found, expected, rtol=1e-9)
