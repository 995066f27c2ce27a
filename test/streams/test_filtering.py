"""Settings of the published tilt, and changes between two samples."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.configuration.filter_settings import Settings
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters.base import filter_named, filters, listed_filters
from twbr_estimation.pipeline.tilt_filter import TiltFilter
from twbr_estimation.robot import Robot
from twbr_estimation.samples import CorrectedSample, TiltEstimate
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream


def sample(angle: float, dt: float = 0.002) -> CorrectedSample:
    zeros = dict.fromkeys(CorrectedSample._fields, 0.0)
    felt = {"accel_x": -9.8 * math.sin(angle), "accel_z": 9.8 * math.cos(angle)}
    return CorrectedSample(**{**zeros, **felt, "dt": dt, "angle": angle})


def stream(**settings: object) -> FilterStream:
    return FilterStream(FilterConfiguration(FilterSettings(**settings)))  # type: ignore[arg-type]


def test_published_tilt_is_predicted_then_offset_then_signed() -> None:
    estimate = TiltEstimate(0.3, 2.0)
    assert stream().published_tilt(estimate, age=0.01) == 0.3
    turned = stream(tilt_sign=-1.0, tilt_offset=0.1, predict=True, prediction_limit=0.02)
    assert turned.published_tilt(estimate, age=0.01) == pytest.approx(-0.22)
    assert turned.published_tilt(estimate, age=5.0) == pytest.approx(-0.24)  # limited
    assert turned.published_tilt(estimate, age=-5.0) == pytest.approx(-0.2)  # clocks disagree


def test_variance_is_the_filters_own_or_the_setting() -> None:
    live = stream(tilt_stddev=0.05)
    unknown, sure = (TiltEstimate(0.0, 0.0, 0.0, v) for v in (0.0, 0.001))
    assert live.variance(unknown) == pytest.approx(0.0025)
    assert live.variance(sure) == 0.001


def test_compare_accepts_all_and_ignores_what_is_empty_or_repeated() -> None:
    assert FilterSettings(compare=("all",)).compared() == tuple(listed_filters())
    assert FilterSettings(compare=("", "gyro", "gyro")).compared() == ("gyro",)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"filter": "unheard_of"}, "unheard_of"),
        ({"compare": ("gyro", "unheard_of")}, "unheard_of"),
        ({"tilt_sign": 0.0}, "tilt_sign: 0.0"),
        ({"tilt_offset": math.nan}, "tilt_offset: nan"),
        ({"prediction_limit": -1.0}, "prediction_limit: -1.0"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        FilterSettings(**settings)  # type: ignore[arg-type]


def test_a_new_configuration_acts_from_the_next_sample_without_a_jump() -> None:
    live = stream(compare=("gyro",))
    for _ in range(100):
        before = live.step(sample(0.2))
        live.compare(sample(0.2))
    changed = FilterConfiguration(
        FilterSettings(filter="kalman", compare=("gyro", "accelerometer")),
        {"complementary": {"time_constant": 9.0}},
        replace(Robot(), wheel_radius=0.05),
    )
    live.configure(changed)
    assert live.settings.filter == "kalman"
    # No more than the step of the new filter itself, which is 0.001 deg here.
    assert live.step(sample(0.2)).tilt == pytest.approx(before.tilt, abs=5e-5)
    assert set(live.compare(sample(0.2))) == {"gyro", "accelerometer"}


def test_a_filter_that_judges_itself_takes_over_a_trusted_tilt_and_is_trusted() -> None:
    live = stream(filter="complementary")
    for _ in range(100):
        before = live.step(sample(0.2))
    assert live.trusted and before.tilt_variance == 0.0
    live.configure(FilterConfiguration(FilterSettings(filter="ins_odometer")))
    for _ in range(100):
        live.step(sample(0.2))
        assert live.trusted


@pytest.mark.parametrize("dt", [0.002, 0.005, 0.01])
@pytest.mark.parametrize(
    ("values", "settings_dt"),
    [({}, 0.0), ({"kalman": {"q1": 1e-4}}, 0.002), ({"alpha_beta_wb": {"alpha": 1e-3}}, 0.005)],
)
def test_live_warnings_are_those_of_offline_runs(
    dt: float, values: dict[str, dict[str, float]], settings_dt: float
) -> None:
    chosen = FilterSettings("alpha_beta_wb", ("kalman", "kalman_tuned"), settings_dt=settings_dt)
    every = {name: entry.configure(values.get(name))._asdict() for name, entry in filters().items()}
    live = FilterStream(FilterConfiguration(chosen, every))
    entries = [filter_named(name) for name in ("alpha_beta_wb", "kalman", "kalman_tuned")]
    offline = Settings(values, dt=settings_dt, source="the parameters")
    expected = list(offline.warnings(dt, entries))
    for entry in entries:
        expected += entry.warnings(entry.configure(values.get(entry.name)), dt)
    assert live.warnings(dt) == tuple(expected)
    assert bool(expected) == (dt != 0.002 or settings_dt == 0.005)
    assert live.warnings(0.0) == ()


def test_reset_starts_from_the_next_sample() -> None:
    live = stream()
    live.step(sample(0.0, dt=0.0))
    assert live.step(sample(0.5)).tilt < 0.1
    live.reset()
    assert live.step(sample(0.5)).tilt == 0.5


def test_period_is_the_mean_without_gaps_since_the_last_question() -> None:
    live = stream()
    assert live.period() == 0.0
    for dt in (0.0, 0.002, 0.004, 5.0):
        live.step(sample(0.1, dt))
    assert live.period() == pytest.approx(0.003)
    assert live.period() == 0.0


def test_switch_continues_the_estimate_and_loses_no_sample() -> None:
    live = stream(filter="complementary")
    for _ in range(50):
        live.step(sample(0.3))
    live.step(sample(1.0))
    before = live.step(sample(1.0))
    live.configure(FilterConfiguration(FilterSettings(filter="alpha_beta_wb")))
    after = live.step(sample(1.0))
    assert abs(after.tilt - before.tilt) < 0.01 * abs(1.0 - before.tilt)


def test_comparison_is_undisturbed_by_switching() -> None:
    alone = TiltFilter(filter_named("alpha_beta_wb"))
    live = stream(filter="complementary", compare=("alpha_beta_wb",))
    switched = FilterSettings(filter="alpha_beta_wb", compare=("alpha_beta_wb",))
    for index, angle in enumerate(np.random.default_rng(1).normal(0.0, 0.1, 60).tolist()):
        if index == 30:
            live.configure(FilterConfiguration(switched))
        live.step(sample(angle))
        assert live.compare(sample(angle)) == {"alpha_beta_wb": alone.step(sample(angle))}


def test_a_refused_configuration_leaves_everything_as_it_was() -> None:
    live, twin = stream(filter="complementary"), stream(filter="complementary")
    refused = FilterConfiguration(
        FilterSettings(filter="gyro", compare=("kalman",)), {"kalman": {"q1": -1.0}}
    )
    live.step(sample(0.3))
    twin.step(sample(0.3))
    with pytest.raises(ConfigurationError, match=r"kalman.q1: -1.0 is outside"):
        live.configure(refused)
    assert live.settings.filter == "complementary"
    assert live.step(sample(1.0)) == twin.step(sample(1.0))
    assert live.compare(sample(1.0)) == {}


def gap_after_a_swing(live: FilterStream) -> TiltEstimate:
    """Feed two seconds of readings that turn, half a second without, and one reading more."""
    for index in range(400):
        live.step(sample(0.0, 0.005)._replace(gyro_y=0.01 * (index % 7)))
    return live.step(sample(0.0, 0.5)._replace(gyro_y=2.0))


@pytest.mark.parametrize("name", ["complementary", "kalman_adaptive", "ins_odometer"])
def test_a_gap_is_counted_and_ends_trust_until_gravity_confirms_the_tilt(name: str) -> None:
    live = stream(filter=name)
    after = gap_after_a_swing(live)
    assert live.counts()["lost_samples"] == 99
    assert not live.trusted
    assert "doubt" in live.distrust()
    assert live.variance(after) > 0.2**2
    for index in range(600):
        live.step(sample(0.0, 0.005)._replace(gyro_y=0.002 * (index % 5 - 2)))
    assert live.trusted


def test_a_change_of_the_filter_keeps_doubt_and_counts() -> None:
    live = stream(filter="complementary")
    gap_after_a_swing(live)
    live.configure(FilterConfiguration(FilterSettings(filter="kalman")))
    live.step(sample(0.0, 0.005))
    assert not live.trusted
    assert live.counts()["lost_samples"] == 99


def test_what_a_filter_does_not_know_its_successor_does_not_know() -> None:
    live = stream(filter="ins_odometer")
    for _ in range(20):
        live.step(sample(0.3, 0.005)._replace(gyro_y=0.5))  # turns at the start: not known
    assert not live.trusted
    live.configure(FilterConfiguration(FilterSettings(filter="complementary")))
    live.step(sample(0.3, 0.005))
    assert not live.trusted
    assert live.variance(TiltEstimate(0.3, 0.0)) > 0.1**2
    for index in range(400):
        live.step(sample(0.3, 0.005)._replace(gyro_y=0.002 * (index % 5 - 2)))
    assert live.trusted


def test_a_gap_that_starts_the_filter_afresh_has_to_be_confirmed() -> None:
    live = stream(filter="complementary")
    gap_after_a_swing(live)
    live.step(sample(0.3, 1.5))
    assert not live.trusted
    for index in range(400):
        live.step(sample(0.3, 0.005)._replace(gyro_y=0.002 * (index % 5 - 2)))
    assert live.trusted


def test_the_active_filter_is_compared_without_a_second_step_until_another_is_chosen() -> None:
    live, alone = stream(filter="kalman", compare=("all",)), stream(filter="kalman")
    beside = stream(filter="complementary", compare=("kalman",))
    for index in range(60):
        each = sample(0.2 * math.sin(0.1 * index))
        if index == 30:
            other = FilterSettings(filter="complementary", compare=("all",))
            live.configure(FilterConfiguration(other, {}, Robot()))
        shown = live.step(each)
        beside.step(each)
        expected = alone.step(each)
        found = live.compare(each)
        assert found["kalman"] == expected == beside.compare(each)["kalman"]
        assert index >= 30 or shown == expected
    assert set(found) == set(listed_filters())
