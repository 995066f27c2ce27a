"""The smoother on the rig: better than the filter, honest, and indifferent to blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, correct, run_filter
from twbr_estimation.drives import Drive
from twbr_estimation.errors import ConfigurationError, RecordingError
from twbr_estimation.filters import filter_named
from twbr_estimation.filters.inertial.error_growth import propagated
from twbr_estimation.filters.inertial.error_state import STATES
from twbr_estimation.filters.inertial.navigation import empty_window, share_kept
from twbr_estimation.filters.ins_odometer import reset
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import WheelTrack
from twbr_estimation.robot import Robot
from twbr_estimation.samples import CorrectedSample, TiltEstimate
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.simulate import Simulated
from twbr_estimation.smoothing import SMOOTHER, smooth
from twbr_estimation.smoothing.forward import transition_of

SQUARE_DEGREES = np.degrees(1.0) ** 2


@pytest.fixture(scope="module")
def rigs() -> list[Simulated]:
    """Drives that nothing was tuned on."""
    return [simulate("W1", 0.005, 20.0, seed) for seed in (6101, 6102, 6103)]


def corrected_of(simulated: Simulated) -> CorrectedTrack:
    return correct(pair(simulated.recording.imu, simulated.recording.wheels), simulated.setup)


def test_hindsight_halves_the_filter_s_error_and_states_its_own(rigs):
    causal, smoothed, normalised = [], [], []
    entry = filter_named(SMOOTHER)
    for each in rigs:
        corrected, truth = corrected_of(each), each.recording.truth.tilt
        track = run_filter(entry, entry.configure(), corrected, each.setup.robot)
        found = smooth(corrected, each.setup.robot, {"mounting": 0.0})  # as it is in W1
        causal.append(np.mean((track.tilt - truth) ** 2) * SQUARE_DEGREES)
        error = np.square(found.tilt - truth)
        smoothed.append(np.mean(error) * SQUARE_DEGREES)
        normalised.append(np.mean(error / found.variance))
    assert np.mean(smoothed) < 0.5 * np.mean(causal)
    assert np.mean(smoothed) < 0.02
    assert 0.1 < np.mean(normalised) < 1.5
    assert found.deviation < smooth(corrected, each.setup.robot).deviation


def test_a_wrong_start_is_undone_with_hindsight(rigs):
    corrected = corrected_of(rigs[0])
    columns = corrected.columns.copy()
    columns[CorrectedSample._fields.index("angle"), 0] += 0.3
    found = smooth(CorrectedTrack(corrected.stamps, columns), rigs[0].setup.robot)
    error = np.abs(found.tilt - rigs[0].recording.truth.tilt)[:200]
    assert error.max() < np.radians(0.5)


def test_blocks_change_nothing_but_memory(rigs, monkeypatch):
    corrected = corrected_of(rigs[0])
    whole = smooth(corrected, rigs[0].setup.robot)
    monkeypatch.setattr("twbr_estimation.smoothing.smoother.BLOCK", 97)
    blocks = smooth(corrected, rigs[0].setup.robot)
    assert np.array_equal(blocks.tilt, whole.tilt)
    assert np.array_equal(blocks.variance, whole.variance)


def test_progress_goes_from_little_to_all(rigs):
    shares: list[float] = []
    smooth(corrected_of(rigs[0]), rigs[0].setup.robot, progress=shares.append)
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < 0.5
    assert shares[-1] == pytest.approx(1.0)


def test_gaps_and_late_or_missing_wheels_are_survived(rigs):
    each = rigs[0]
    imu, wheels = each.recording.imu, each.recording.wheels
    keep = np.ones(imu.stamps.size, dtype=bool)
    keep[1500:2000] = False
    cut = replace(imu, stamps=imu.stamps[keep], gyro=imu.gyro[keep], accel=imu.accel[keep])
    late = WheelTrack(wheels.stamps[1000:], wheels.angle[1000:])
    for recording, worst in (
        (replace(each.recording, imu=cut), 0.1),
        (replace(each.recording, wheels=late), 1.0),
        (replace(each.recording, wheels=None), 8.0),
    ):
        found = Drive(recording, each.setup).smoothed()
        truth = np.interp(found.stamps, each.recording.truth.stamps, each.recording.truth.tilt)
        assert np.all(np.isfinite(found.tilt))
        assert np.all(found.variance > 0.0)
        assert np.mean((found.tilt - truth) ** 2) * SQUARE_DEGREES < worst


def test_parameters_are_the_filter_s(rigs):
    corrected = corrected_of(rigs[0])
    usual = smooth(corrected, rigs[0].setup.robot)
    doubtful = smooth(corrected, rigs[0].setup.robot, {"wheel_noise": 0.01})
    assert doubtful.deviation > usual.deviation
    with pytest.raises(ConfigurationError, match="no parameter 'wheels'"):
        smooth(corrected, rigs[0].setup.robot, {"wheels": 2.0})


def test_a_single_sample_is_refused(rigs):
    imu = rigs[0].recording.imu
    short = replace(imu, stamps=imu.stamps[:1], gyro=imu.gyro[:1], accel=imu.accel[:1])
    with pytest.raises(RecordingError, match="fewer than two samples"):
        Drive(replace(rigs[0].recording, imu=short, wheels=None), rigs[0].setup).smoothed()


def test_transition_is_that_of_the_covariance():
    """The noise that `propagated` adds does not depend on P, so differences show F alone."""
    random = np.random.default_rng(3)
    entry = filter_named(SMOOTHER)
    c = entry.derive(entry.configure(), Robot())
    sample = CorrectedSample(0.005, 0.1, 0.01, *random.normal(0.0, 1.0, 6), *[1e-4] * 6, 0, 0, 0)
    state = reset(TiltEstimate(0.1, 0.2), sample, c)
    nav = state.navigation._replace(velocity=(0.7, -0.2, 0.1))
    window = empty_window()._replace(
        time=0.005,
        exceeded=(0.004, 0.0),
        turn=tuple(random.normal(0.0, 0.01, 3)),
        push=tuple(random.normal(0.0, 0.1, 3)),
    )
    half = random.standard_normal((STATES, STATES))
    square = half @ half.T
    keep = share_kept(window.time, c.accel_bias_time)
    moved = propagated(square.copy(), nav, state.last, window, keep, 1.0, c)
    moved = moved - propagated(np.zeros((STATES, STATES)), nav, state.last, window, keep, 1.0, c)
    f = transition_of(nav, state.last, window, c, 1.0)
    assert f @ square @ f.T == pytest.approx(moved, rel=1e-9, abs=1e-12)
