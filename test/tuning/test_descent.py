"""Least squares from one place downhill."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.recording import FloatArray
from twbr_estimation.tuning.descent import Descent
from twbr_estimation.tuning.merit import USELESS, Merit

LOW, HIGH = np.full(2, -5.0), np.full(2, 5.0)


class Counted:
    """Errors of a place, counting how often they were asked for."""

    def __init__(self, best: tuple[float, float]) -> None:
        self.best, self.count = best, 0

    def __call__(self, place: FloatArray) -> Merit:
        """Rosenbrock's valley, with its end moved."""
        assert np.all(place >= LOW) and np.all(place <= HIGH)
        self.count += 1
        x, y = place - self.best + 1.0
        errors = np.array([10.0 * (y - x * x), 1.0 - x])
        return Merit(float(errors @ errors), errors)


def test_a_bent_valley_is_followed_to_its_end_in_few_evaluations() -> None:
    run = Counted((1.0, 1.0))
    descent = Descent(run, np.array([-1.2, 1.0]), LOW, HIGH)
    assert descent.figure == pytest.approx(24.2)
    descent.go_on(150)
    assert descent.figure < 1e-8
    assert run.count <= 151


def test_it_goes_on_where_it_stopped() -> None:
    whole, parts = (Descent(Counted((1.0, 1.0)), np.array([-1.2, 1.0]), LOW, HIGH) for _ in "ab")
    whole.go_on(60)
    before = math.inf
    for _ in range(3):
        parts.go_on(20)
        assert parts.figure <= before
        before = parts.figure
    assert parts.figure < 1e-2 * 24.2


def test_a_best_place_beyond_the_bounds_is_met_at_them() -> None:
    def run(place: FloatArray) -> Merit:
        errors = place - np.array([7.0, 1.0])
        return Merit(float(errors @ errors), errors)

    descent = Descent(run, np.zeros(2), LOW, HIGH)
    descent.go_on(60)
    assert descent.figure == pytest.approx(4.0, rel=1e-6)


def test_a_place_that_diverges_is_left_alone() -> None:
    calls = 0

    def run(place: FloatArray) -> Merit:
        nonlocal calls
        calls += 1
        return USELESS

    descent = Descent(run, np.zeros(2), LOW, HIGH)
    descent.go_on(50)
    assert (descent.figure, calls) == (math.inf, 1)


def test_parameters_without_effect_end_it_soon() -> None:
    run_count = 0

    def run(place: FloatArray) -> Merit:
        nonlocal run_count
        run_count += 1
        return Merit(3.0, np.array([1.0, 1.0, 1.0]))

    Descent(run, np.zeros(2), LOW, HIGH).go_on(100)
    assert run_count < 8
