from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest

from twbr_estimation.filters.base import Parameter
from twbr_estimation.parameters.bounds import Bounds
from twbr_estimation.tuning.axis import SearchAxis
from twbr_estimation.tuning.merit import USELESS, Merit
from twbr_estimation.tuning.search import search

WIDE = {
    "gain": Parameter("gain", 0.1, Bounds(-5.0, 5.0, "1", "signed")),
    "noise": Parameter("noise", 1e-3, Bounds(0.0, 1e3, "1", "logarithmic", logarithmic=True)),
}


def merit(*errors: float) -> Merit:
    return Merit(math.fsum(error * error for error in errors), np.array(errors))


def two_valleys(values: Mapping[str, float]) -> Merit:
    """Deepest at gain 3, noise 1e-5; a shallower valley at gain -0.5 catches a local search."""
    gain = min(0.1 * (values["gain"] - 3.0) ** 2, 0.2 + 4.0 * (values["gain"] + 0.5) ** 2)
    return merit(math.sqrt(gain), math.log10(values["noise"] / 1e-5))


def test_the_deeper_of_two_valleys_is_found_over_decades() -> None:
    found = search(WIDE, two_valleys, [{"gain": -0.4, "noise": 1e-3}])
    assert found.figure < 1e-4
    assert found.values["gain"] == pytest.approx(3.0, abs=0.02)
    assert found.values["noise"] == pytest.approx(1e-5, rel=0.02)


@pytest.mark.parametrize("seed", range(1, 6))
def test_it_is_found_with_every_seed(seed: int) -> None:
    found = search(WIDE, two_valleys, [{"gain": -0.4, "noise": 1e-3}], seed)
    assert found.figure < 1e-4


def test_points_are_chosen_by_a_rougher_judge() -> None:
    begun: list[float] = []

    def judge(values: Mapping[str, float]) -> Merit:
        begun.append(values["gain"])
        return two_valleys(values)

    def left(values: Mapping[str, float]) -> Merit:
        return merit(values["gain"] + 4.0, math.log10(values["noise"]))

    search(WIDE, judge, rough=left)
    assert min(begun) < -3.0 and sum(gain > 4.0 for gain in begun) < 5


def test_the_same_seed_finds_the_same() -> None:
    assert search(WIDE, two_valleys, seed=4) == search(WIDE, two_valleys, seed=4)


def test_settings_that_diverge_are_avoided() -> None:
    found = search(WIDE, lambda v: USELESS if v["gain"] > 0.0 else two_valleys(v))
    assert found.values["gain"] == pytest.approx(-0.5, abs=0.02)


def test_nothing_to_search_is_one_evaluation() -> None:
    found = search({}, lambda values: Merit(7.0, np.zeros(0)))
    assert (found.values, found.figure, found.evaluations) == ({}, 7.0, 1)


MANY = {f"p{index}": Parameter(f"p{index}", 1.0, Bounds(0.0, 9.0, "1", "")) for index in range(6)}


def bowl(values: Mapping[str, float]) -> Merit:
    return merit(*(value - 0.8 for value in values.values()))


def test_many_parameters_are_refined_by_a_few_steps_unless_thoroughly() -> None:
    quick, thorough = (search(MANY, bowl, thorough=flag) for flag in (False, True))
    assert quick.evaluations < 60 < 300 < thorough.evaluations
    assert thorough.figure < 1e-6 < quick.figure < 0.5 * bowl(dict.fromkeys(MANY, 1.0)).figure


def test_parameters_that_change_nothing_cost_one_evaluation_each() -> None:
    asked: list[Mapping[str, float]] = []

    def one(values: Mapping[str, float]) -> Merit:
        asked.append(values)
        return merit(values["p3"] - 0.8)

    found = search(MANY, one)
    others = [dict(values, p3=1.0) for values in asked]
    assert found.figure < 1e-6
    assert sum(values != dict.fromkeys(MANY, 1.0) for values in others) == len(MANY) - 1


def test_a_valley_far_from_every_start_is_found_thoroughly_only() -> None:
    def far(values: Mapping[str, float]) -> Merit:
        near_start = merit(0.1, *(value - 1.0 for value in values.values()))
        elsewhere = merit(*(0.3 * (value - 5.0) for value in values.values()))
        return min(near_start, elsewhere, key=lambda each: each.figure)

    quick, thorough = (search(MANY, far, thorough=flag) for flag in (False, True))
    assert quick.figure > 0.0099
    assert thorough.figure < 1e-6


def test_a_kink_that_slopes_do_not_show_is_searched_by_the_simplex() -> None:
    def kinked(values: Mapping[str, float]) -> Merit:
        gain, noise = values["gain"] - 1.3, math.log10(values["noise"])
        figure = 1.0 + abs(gain) + abs(noise + 0.5 * gain)
        return Merit(figure, np.array([1.0, 0.0]))  # the errors say that nothing matters

    found = search(WIDE, kinked)
    assert found.figure < 1.001


def test_progress_is_called_for_every_evaluation_and_may_stop() -> None:
    heard: list[float] = []

    def watch(best: float, values: Mapping[str, float]) -> None:
        assert two_valleys(values).figure == best
        heard.append(best)
        if len(heard) == 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search(WIDE, two_valleys, progress=watch)
    assert len(heard) == 30
    assert heard == sorted(heard, reverse=True)
    assert heard[-1] < heard[0]  # points count before they are refined


@pytest.mark.parametrize("parameter", WIDE.values(), ids=WIDE)
def test_an_axis_returns_what_it_was_given_and_stays_within_bounds(parameter: Parameter) -> None:
    axis = SearchAxis(parameter)
    for value in (parameter.default, 0.7 * parameter.bounds.maximum):
        assert axis.value(axis.scaled(value)) == pytest.approx(value)
    assert axis.value(axis.high + 1.0) == parameter.bounds.maximum
    assert axis.value(axis.low - 1.0) >= parameter.bounds.minimum
