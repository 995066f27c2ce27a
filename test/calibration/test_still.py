"""Biases and noise from a recording at rest, against the constants the rig hides."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.calibration.drift import standard_errors
from twbr_estimation.calibration.still import StillOptions, calibrate_still
from twbr_estimation.errors import CalibrationError, MotionError, RecordingError
from twbr_estimation.recording import ImuTrack
from twbr_estimation.robot import Setup
from twbr_estimation.simulation import simulate


@pytest.mark.parametrize("world", ["paper", "W2"])
@pytest.mark.parametrize("seed", [21, 22, 23])
def test_hidden_biases_lie_within_three_standard_errors(world, seed):
    simulated = simulate(world, 0.005, 60.0, seed, "still")
    found = calibrate_still(simulated.recording, Setup(), StillOptions())
    true = simulated.true_setup.calibration
    gyro = np.subtract(found.calibration.gyro_bias, true.gyro_bias) / found.gyro_error
    accel = np.subtract(found.calibration.accel_bias, true.accel_bias) / found.accel_error
    assert np.all(np.abs(gyro) < 3.0) and np.all(np.abs(accel) < 3.0)
    # Errors that say something: a tenth of a degree per second, a hundredth of g.
    assert max(found.gyro_error) < math.radians(0.1) and max(found.accel_error) < 0.1
    assert found.gyro_noise == pytest.approx((math.radians(0.1018),) * 3, rel=0.03)
    assert found.accel_noise == pytest.approx((0.0284, 0.0284, 0.0402), rel=0.03)


def test_errors_of_a_drifting_mean_cover_it():
    generator = np.random.default_rng(5)
    keep, count, runs = math.exp(-1.0 / 100.0), 60, 100
    drift = np.empty((count, runs))
    drift[0] = generator.standard_normal(runs)
    for row in range(1, count):
        fresh = generator.standard_normal(runs) * math.sqrt(1.0 - keep**2)
        drift[row] = keep * drift[row - 1] + fresh
    values = drift + 0.2 * generator.standard_normal((count, runs))
    errors = standard_errors(values, 1.0, usual_drift=1.0)
    score = values.mean(axis=0) / errors
    assert 0.6 < np.sqrt(np.mean(score**2)) < 1.5
    # Uncorrelated noise alone would claim thirty times less.
    assert np.median(errors) > 10.0 * 0.2 / math.sqrt(count)


def test_white_noise_over_long_leaves_little_error():
    values = np.random.default_rng(6).standard_normal((60_000, 1))
    short = standard_errors(values[:600], 0.01, usual_drift=0.1)
    long = standard_errors(values, 0.01, usual_drift=0.1)
    assert long < 0.5 * short


def test_the_tilt_it_stands_at_is_taken_out():
    simulated = simulate("paper", 0.005, 10.0, 4, "still")
    upright = calibrate_still(simulated.recording, Setup(), StillOptions())
    leaning = calibrate_still(simulated.recording, Setup(), StillOptions(tilt=0.1))
    change = np.subtract(leaning.calibration.accel_bias, upright.calibration.accel_bias)
    gravity = 9.80665
    expected = [gravity * math.sin(0.1), 0.0, gravity * (1.0 - math.cos(0.1))]
    np.testing.assert_allclose(change, expected, atol=1e-12)


def test_motion_is_refused_with_when_and_how_much():
    recording = simulate("paper", 0.005, 10.0, 4, "still").recording
    gyro = recording.imu.gyro.copy()
    gyro[1200:1300, 1] += 0.5
    imu = ImuTrack(recording.imu.stamps, gyro, recording.imu.accel)
    with pytest.raises(MotionError, match=r"5\.0 % of the 10\.0 s, most 6\.\d s .* rate 0\.5"):
        calibrate_still(replace(recording, imu=imu), Setup(), StillOptions())


def test_a_short_recording_is_refused():
    recording = simulate("paper", 0.005, 3.0, 4, "still").recording
    with pytest.raises(RecordingError, match=r"3\.00 s are too short, 5 s"):
        calibrate_still(recording, Setup(), StillOptions())


def test_drift_is_shown_over_windows():
    recording = simulate("paper", 0.005, 20.0, 4, "still").recording
    found = calibrate_still(recording, Setup(), StillOptions(window=2.0))
    assert found.gyro_windows.shape == found.accel_windows.shape == (10, 3)
    np.testing.assert_allclose(found.gyro_windows[3], recording.imu.gyro[1200:1600].mean(axis=0))
    assert found.gyro_extremes[0] == tuple(recording.imu.gyro.min(axis=0))


@pytest.mark.parametrize(
    ("by", "said"),
    [
        (lambda force: force / 9.80665, "it is in g"),
        (lambda force: -force, "upside down"),
        (lambda force: force - force.mean(axis=0), "removes gravity"),
        (lambda force: force[:, [2, 1, 0]], "axes"),
    ],
)
def test_a_bias_that_no_board_has_is_refused(by, said) -> None:
    recording = simulate("paper", 0.01, 10.0, 3, "still").recording
    imu = replace(recording.imu, accel=by(recording.imu.accel))
    with pytest.raises(CalibrationError, match=said):
        calibrate_still(replace(recording, imu=imu), Setup(), StillOptions())


def test_a_bias_of_a_poor_board_is_taken() -> None:
    recording = simulate("paper", 0.01, 10.0, 3, "still").recording
    imu = replace(recording.imu, accel=np.add(recording.imu.accel, (2.0, -2.0, 3.0)))
    found = calibrate_still(replace(recording, imu=imu), Setup(), StillOptions())
    assert found.calibration.accel_bias[0] == pytest.approx(2.0, abs=0.1)
