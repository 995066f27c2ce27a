"""One live filter: start, gap, parameters."""

from __future__ import annotations

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.tilt_filter import TiltFilter
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


def test_parameters_change_between_two_samples_without_a_jump() -> None:
    running = TiltFilter(filter_named("complementary"))
    for _ in range(10):
        before = running.step(sample(0.3))
    running.configure({"time_constant": 5.0})
    assert running.step(sample(0.3)).tilt == pytest.approx(before.tilt, abs=1e-12)


def test_refused_parameters_leave_those_before() -> None:
    running, twin = (
        TiltFilter(filter_named("complementary"), {"time_constant": 2.0}) for _ in "ab"
    )
    with pytest.raises(ConfigurationError, match=r"complementary.time_constant: -1.0 is outside"):
        running.configure({"time_constant": -1.0})
    for angle in (0.0, 1.0, 1.0):
        assert running.step(sample(angle)) == twin.step(sample(angle))
