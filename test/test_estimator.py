"""The live filters: start, gap, switch, comparison, parameters."""

from __future__ import annotations

import numpy as np
import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.estimator import FilterBank, TiltFilter
from twbr_estimation.filters import filter_named
from twbr_estimation.samples import CorrectedSample


def sample(angle: float, rate: float = 0.0, dt: float = 0.01) -> CorrectedSample:
    """Return a corrected sample with the given angle [rad] and rate [rad/s]."""
    zeros = dict.fromkeys(CorrectedSample._fields, 0.0)
    return CorrectedSample(**{**zeros, "dt": dt, "angle": angle, "gyro_y": rate, "accel_z": 9.8})


def test_first_sample_gives_its_own_angle_and_rate() -> None:
    estimate = TiltFilter(filter_named("complementary")).step(sample(0.2, 0.5, dt=0.0))
    assert estimate.tilt == 0.2
    assert estimate.rate == 0.5


def test_gap_starts_afresh_and_keeps_the_bias() -> None:
    running = TiltFilter(filter_named("alpha_beta_wb"), {"alpha": 0.1, "beta": -0.5})
    for _ in range(300):
        running.step(sample(0.0, 0.1))
    learned = running.estimate
    assert learned is not None
    assert learned.gyro_bias == pytest.approx(0.1, abs=0.02)
    after = running.step(sample(0.7, 0.1, dt=5.0))
    assert after.tilt == 0.7
    assert after.gyro_bias == learned.gyro_bias


def test_switch_continues_the_estimate_and_loses_no_sample() -> None:
    bank = FilterBank("complementary")
    for _ in range(50):
        before = bank.step(sample(0.3))
    bank.step(sample(1.0))
    before = bank.step(sample(1.0))
    bank.switch("alpha_beta_wb")
    after = bank.step(sample(1.0))
    assert bank.active == "alpha_beta_wb"
    assert abs(after.tilt - before.tilt) < 0.01 * abs(1.0 - before.tilt)


def test_comparison_is_undisturbed_by_switching() -> None:
    alone = TiltFilter(filter_named("alpha_beta_wb"))
    bank = FilterBank("complementary", compare=["alpha_beta_wb"])
    angles = np.random.default_rng(1).normal(0.0, 0.1, 60)
    for index, angle in enumerate(angles):
        if index == 30:
            bank.switch("alpha_beta_wb")
        bank.step(sample(float(angle)))
        alone.step(sample(float(angle)))
    assert bank.compared() == {"alpha_beta_wb": alone.estimate}


def test_refused_changes_leave_everything_as_it_was() -> None:
    bank = FilterBank("complementary", values={"complementary": {"time_constant": 2.0}})
    with pytest.raises(ConfigurationError, match="no filter 'unheard_of'"):
        bank.switch("unheard_of")
    with pytest.raises(ConfigurationError, match="no filter 'unheard_of'"):
        bank.run_beside(["alpha_beta_wb", "unheard_of"])
    with pytest.raises(ConfigurationError, match=r"complementary.time_constant: -1.0 is outside"):
        bank.configure("complementary", {"time_constant": -1.0})
    assert bank.active == "complementary"
    assert bank.compare == ()
    twin = FilterBank("complementary", values={"complementary": {"time_constant": 2.0}})
    for angle in (0.0, 1.0, 1.0):
        assert bank.step(sample(angle)) == twin.step(sample(angle))


def test_parameters_change_between_two_samples_without_a_jump() -> None:
    bank = FilterBank("complementary")
    for _ in range(10):
        before = bank.step(sample(0.3))
    bank.configure("complementary", {"time_constant": 5.0})
    assert bank.step(sample(0.3)).tilt == pytest.approx(before.tilt, abs=1e-12)
