"""Least squares from one place downhill."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.recording import FloatArray
from twbr_estimation.tuning.descent import descend
from twbr_estimation.tuning.merit import USELESS, Merit

LOW, HIGH = np.full(2, -5.0), np.full(2, 5.0)


def valley(place: FloatArray) -> Merit:
    """Rosenbrock's: bent, with its end at 1, 1."""
    assert np.all(place >= LOW) and np.all(place <= HIGH)
    x, y = place
    errors = np.array([10.0 * (y - x * x), 1.0 - x])
    return Merit(float(errors @ errors), errors)


def test_a_bent_valley_is_followed_to_its_end() -> None:
    figure, place = descend(valley, np.array([-1.2, 1.0]), LOW, HIGH, 60)
    assert figure < 1e-8
    assert place == pytest.approx([1.0, 1.0], abs=1e-3)


def test_more_steps_lead_further() -> None:
    figures = [descend(valley, np.array([-1.2, 1.0]), LOW, HIGH, n)[0] for n in (2, 10, 40)]
    assert 24.2 > figures[0] > figures[1] > figures[2]


def test_a_best_place_beyond_the_bounds_is_met_at_them() -> None:
    def run(place: FloatArray) -> Merit:
        errors = place - np.array([7.0, 1.0])
        return Merit(float(errors @ errors), errors)

    figure, place = descend(run, np.zeros(2), LOW, HIGH, 30)
    assert figure == pytest.approx(4.0, rel=1e-3)
    assert place == pytest.approx([5.0, 1.0], abs=1e-2)


def test_a_setting_that_diverges_is_no_way_down() -> None:
    def run(place: FloatArray) -> Merit:
        return USELESS if place[0] > 0.5 else valley(place)

    figure, place = descend(run, np.array([-1.2, 1.0]), LOW, HIGH, 60)
    assert place[0] <= 0.5
    assert 0.0 < figure < 24.2


@pytest.mark.parametrize("merit", [USELESS, Merit(1e300, np.full(2, 1e150))])
def test_a_start_that_diverges_is_left_alone(merit: Merit) -> None:
    assert descend(lambda place: merit, np.zeros(2), LOW, HIGH, 9)[0] == math.inf


@pytest.mark.filterwarnings("error")
def test_errors_too_large_to_be_squared_are_no_way_down() -> None:
    def run(place: FloatArray) -> Merit:
        return Merit(1e300, np.full(2, 1e150)) if place[0] > -1.0 else valley(place)

    assert descend(run, np.array([-1.2, 1.0]), LOW, HIGH, 60)[1][0] <= -1.0
