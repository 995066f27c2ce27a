"""Correction and filters tuned on rig recordings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import pytest

from twbr_estimation.filters import filter_named
from twbr_estimation.tuning.correction import corrected_mse, raw_mse, tune_correction
from twbr_estimation.tuning.filter import (
    TunedFilter,
    TuningTask,
    judged,
    mean_square_error,
    tune_filter,
)
from twbr_estimation.tuning.several import tune_filters
from twbr_estimation.tuning.warnings import saturation_warnings, warnings_for
from twbr_estimation.workers import ThisProcess


def test_the_time_constants_found_are_better_than_their_neighbours(task: TuningTask) -> None:
    tuned = tune_correction(task.training)
    assert tuned.mse_after_deg2 < 0.8 * tuned.mse_before_deg2
    assert tuned.mse_before_deg2 == raw_mse(task.training)
    assert tuned.settings.dt == pytest.approx(0.01)
    for name in ("rate_time_constant", "velocity_time_constant"):
        for factor in (0.8, 1.25):
            other = replace(tuned.settings, **{name: factor * getattr(tuned.settings, name)})
            assert corrected_mse(task.training, other) > tuned.mse_after_deg2


def test_a_term_that_is_off_keeps_its_time_constant(task: TuningTask) -> None:
    base = replace(task.training[0].setup.correction, euler=False, rate_time_constant=0.5)
    tuned = tune_correction([task.training[0].corrected_with(base)])
    assert tuned.settings.rate_time_constant == 0.5
    assert tuned.settings.velocity_time_constant != base.velocity_time_constant


def test_an_interrupted_search_for_time_constants_keeps_the_best(task: TuningTask) -> None:
    calls = 0

    def interrupt(best: float, values: Mapping[str, float]) -> None:
        nonlocal calls
        calls += 1
        if calls == 10:
            raise KeyboardInterrupt

    tuned = tune_correction(task.training, progress=interrupt)
    assert tuned.interrupted
    assert tuned.mse_after_deg2 == pytest.approx(corrected_mse(task.training, tuned.settings))


@pytest.mark.parametrize("name", ["complementary", "alpha_beta_wb", "kalman_tuned"])
def test_a_tuned_filter_beats_defaults_and_start(task: TuningTask, name: str) -> None:
    entry = filter_named(name)
    tuned = tune_filter(task, name)
    assert tuned.training_mse_deg2 < mean_square_error(entry, {}, task.training)
    assert tuned.training_mse_deg2 == mean_square_error(entry, tuned.values, task.training)
    assert tuned.verification_mse_deg2 == mean_square_error(entry, tuned.values, task.verification)
    assert tune_filter(task, name) == tuned, "the same seed finds the same"


def test_what_does_not_forget_a_wrong_start_is_not_chosen(task: TuningTask) -> None:
    # Without a pull towards the angle, alpha = 0, this filter is best on some short recordings.
    tuned = tune_filter(task, "alpha_beta_wb")
    assert (1.0 - tuned.values["alpha"]) ** (60.0 / 0.01) < math.exp(-1.0) + 1e-9


def test_r_of_a_kalman_filter_is_called_not_identifiable(task: TuningTask) -> None:
    entry = filter_named("kalman_tuned")
    values = {"q1": 1e-7, "q2": 1e-12, "r": 1e-3}
    scaled = {name: 3.0 * value for name, value in values.items()}
    figures = [mean_square_error(entry, each, task.training) for each in (values, scaled)]
    assert figures[0] == pytest.approx(figures[1], rel=1e-9)
    warnings = judged(task, "kalman_tuned", values).warnings
    assert any("kalman_tuned.r: not identifiable" in text for text in warnings)
    assert not any("kalman_tuned.q1" in text for text in warnings)


@pytest.mark.parametrize(("verification", "warned"), [(1.9, False), (2.1, True), (None, False)])
def test_over_fit_is_reported(verification: float | None, warned: bool) -> None:
    entry = filter_named("complementary")
    values = {"time_constant": 1.0}
    found = warnings_for(entry, values, 0.01, 1.0, verification, lambda v: v["time_constant"])
    assert any("over-fit" in text for text in found) == warned


def test_a_parameter_that_does_nothing_is_reported() -> None:
    entry = filter_named("complementary")
    (warning,) = warnings_for(entry, {"time_constant": 1.0}, 0.01, 1.0, 1.0, lambda values: 1.0)
    assert "complementary.time_constant: halved or doubled" in warning


def test_saturation_is_reported(task: TuningTask) -> None:
    saturated = replace(task.training[0], source="bag_7", saturated=0.02)
    (warning,) = saturation_warnings([saturated, replace(saturated, saturated=0.0)])
    assert warning.startswith("bag_7: 2.00 % of the samples are saturated")


def test_ctrl_c_keeps_what_is_done_and_the_best_so_far(task: TuningTask) -> None:
    names = ["complementary", "alpha_beta_wob", "alpha_beta_wb"]
    last: dict[str, float] = {}

    def interrupt(name: str, figure: float, values: Mapping[str, float]) -> None:
        last[name] = figure
        if name == "alpha_beta_wob":
            raise KeyboardInterrupt

    done, begun = tune_filters(task, names, ThisProcess(), interrupt)
    assert (done.name, done.interrupted) == ("complementary", False)
    assert (begun.name, begun.interrupted) == ("alpha_beta_wob", True)
    assert isinstance(begun, TunedFilter)
    assert begun.training_mse_deg2 == pytest.approx(last["alpha_beta_wob"])
