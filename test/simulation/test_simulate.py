from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.batch import correct, run_filter
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters.base import filter_named
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.robot import CorrectionSettings, Robot, Setup
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.simulation import Simulated, World, simulate
from twbr_estimation.simulation.worlds import PAPER, W1, W2

SEEDS = (101, 102, 103)


@pytest.fixture(scope="module")
def drives() -> list[Simulated]:
    return [simulate("paper", 0.002, 60.0, seed) for seed in SEEDS]


def errors_deg(angle: np.ndarray, simulated: Simulated) -> np.ndarray:
    reference = simulated.recording.reference
    assert reference is not None
    turned = np.mod(angle - reference.tilt + math.pi, 2.0 * math.pi) - math.pi
    return np.degrees(turned)


def mse_deg2(angle: np.ndarray, simulated: Simulated) -> float:
    return float(np.mean(errors_deg(angle, simulated) ** 2))


def corrected(simulated: Simulated, settings: CorrectionSettings | None = None):
    setup = simulated.setup
    if settings is not None:
        setup = replace(setup, correction=settings)
    return correct(pair(simulated.recording.imu, simulated.recording.wheels), setup)


def raw_angle(simulated: Simulated) -> np.ndarray:
    accel = simulated.recording.imu.accel
    return np.arctan2(-accel[:, 0], accel[:, 2])


def same(one: Simulated, other: Simulated) -> bool:
    pairs = (
        (one.recording.imu.gyro, other.recording.imu.gyro),
        (one.recording.imu.accel, other.recording.imu.accel),
        (one.recording.wheels.angle, other.recording.wheels.angle),
        (one.recording.truth.tilt, other.recording.truth.tilt),
    )
    return all(np.array_equal(left, right) for left, right in pairs)


def test_the_seed_decides_everything():
    first = simulate("W2", 0.005, 3.0, 7)
    assert same(first, simulate("W2", 0.005, 3.0, 7))
    assert not same(first, simulate("W2", 0.005, 3.0, 8))


def test_another_gyro_does_not_change_the_drive():
    one, other = simulate(PAPER, 0.005, 5.0, 3), simulate(W1, 0.005, 5.0, 3)
    np.testing.assert_array_equal(one.recording.truth.tilt, other.recording.truth.tilt)
    np.testing.assert_array_equal(one.recording.imu.accel, other.recording.imu.accel)
    assert not np.array_equal(one.recording.imu.gyro, other.recording.imu.gyro)


def test_another_rate_samples_the_same_drive():
    slow, fast = simulate("paper", 0.02, 5.0, 3), simulate("paper", 0.002, 5.0, 3)
    assert slow.recording.dt == pytest.approx(0.02)
    np.testing.assert_array_equal(slow.recording.truth.tilt, fast.recording.truth.tilt[::10])


def test_a_longer_drive_begins_like_a_shorter_one():
    short, long = simulate("W2", 0.005, 5.0, 3), simulate("W2", 0.005, 9.0, 3)
    assert short.recording.imu.stamps.size == 1000
    np.testing.assert_array_equal(short.recording.imu.accel, long.recording.imu.accel[:1000])
    np.testing.assert_array_equal(short.recording.imu.gyro, long.recording.imu.gyro[:1000])


@pytest.mark.parametrize(("dt", "limit"), [(0.0005, 0.01), (0.002, 0.1)])
def test_perfect_sensors_give_the_truth_up_to_differentiation(dt, limit):
    """A wrong sign or a missing term costs more than the differences do, by far."""
    settings = CorrectionSettings(rate_time_constant=0.0, velocity_time_constant=0.0)
    for seed in SEEDS:
        simulated = simulate("ideal", dt, 20.0, seed)
        assert simulated.falls == 0

        def mse(terms: CorrectionSettings, drive: Simulated = simulated) -> float:
            return mse_deg2(corrected(drive, terms).field("angle"), drive)

        assert mse(settings) < limit
        for term in ("euler", "wheel"):
            assert mse(replace(settings, **{term: False})) > 50.0 * mse(settings)


def test_integrated_perfect_gyro_is_the_truth():
    simulated = simulate("ideal", 0.0005, 20.0, 4)
    gyro, truth = simulated.recording.imu.gyro[:, 1], simulated.recording.truth
    tilt = np.concatenate([[0.0], np.cumsum(0.5 * (gyro[1:] + gyro[:-1])) * 0.0005])
    np.testing.assert_allclose(tilt, truth.tilt, atol=1e-4)


def test_the_encoder_on_the_body_counts_wheel_minus_body():
    simulated = simulate(replace(PAPER, impacts=False), 0.002, 10.0, 5)
    step = 2.0 * math.pi / 1320
    counts = simulated.recording.wheels.angle[:, 0] / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    held = simulate("ideal", 0.002, 40.0, 5, "poses").recording
    np.testing.assert_allclose(held.wheels.angle[:, 0], -held.truth.tilt, atol=1e-12)


def test_the_reference_encoder_is_within_half_a_count(drives):
    for simulated in drives:
        error = simulated.recording.reference.tilt - simulated.recording.truth.tilt
        step = 2.0 * math.pi / 2000
        assert float(np.max(np.abs(error))) <= 0.5 * step + 1e-12
        assert float(np.std(error)) == pytest.approx(step / math.sqrt(12.0), rel=0.2)


def test_the_paper_s_robot_moves_as_the_paper_s(drives):
    """Table 1's 2 ms row is 150.6 and 72.5 deg^2; the rest as on the paper's figures."""
    tilt = np.sqrt(np.mean([np.var(s.recording.truth.tilt) for s in drives]))
    rate = np.sqrt(np.mean([np.var(s.recording.truth.rate) for s in drives]))
    assert 9.0 < math.degrees(tilt) < 14.0
    assert 55.0 < math.degrees(rate) < 85.0
    assert 1 <= np.mean([s.falls for s in drives]) <= 7
    assert 0.0005 < np.mean([s.saturated for s in drives]) < 0.015
    raw = np.mean([mse_deg2(raw_angle(s), s) for s in drives])
    after = np.mean([mse_deg2(corrected(s).field("angle"), s) for s in drives])
    assert 90.0 < raw < 200.0
    assert 45.0 < after < 110.0
    assert after < 0.8 * raw


def test_the_complementary_filter_has_its_best_time_constant_near_a_second(drives):
    entry = filter_named("complementary")

    def mse(time_constant: float) -> float:
        parameters = entry.configure({"time_constant": time_constant})
        tracks = [run_filter(entry, parameters, corrected(s), s.setup.robot) for s in drives]
        return float(np.mean([mse_deg2(t.tilt, s) for t, s in zip(tracks, drives, strict=True)]))

    assert mse(1.2) < min(mse(0.2), mse(6.0))
    assert 0.5 < mse(1.2) < 5.0


def test_a_still_robot_shows_its_biases():
    simulated = simulate(replace(PAPER, gyro_drift_deg=0.0), 0.002, 60.0, 1, "still")
    imu, calibration = simulated.recording.imu, simulated.setup.calibration
    count = math.sqrt(imu.stamps.size)
    bias = np.mean(imu.gyro, axis=0) - calibration.gyro_bias
    assert np.all(np.abs(bias) < 4.0 * calibration.gyro_noise / count)
    np.testing.assert_allclose(np.std(imu.gyro, axis=0), calibration.gyro_noise, rtol=0.1)
    np.testing.assert_allclose(np.std(imu.accel, axis=0), PAPER.accel_noise, rtol=0.1)
    assert 8.98 < np.mean(imu.accel[:, 2]) < 9.39


def test_poses_reach_eighty_degrees_and_hold_still():
    simulated = simulate("paper", 0.005, 60.0, 1, "poses")
    truth = simulated.recording.truth
    assert math.degrees(np.min(truth.tilt)) == pytest.approx(-80.0, abs=0.01)
    assert math.degrees(np.max(truth.tilt)) == pytest.approx(80.0, abs=0.01)
    assert np.mean(truth.rate == 0.0) > 0.6
    held = truth.rate == 0.0
    settings = CorrectionSettings(euler=False, centrifugal=False, wheel=False)
    track = corrected(simulated, settings)
    forward = track.field("accel_x") + STANDARD_GRAVITY * np.sin(truth.tilt)
    assert abs(float(np.mean(forward[held]))) < 0.005


def test_worlds_give_the_estimator_wrong_parameters():
    true, told = simulate("W2", 0.02, 1.0, 1).true_setup, simulate("W2", 0.02, 1.0, 1).setup
    assert told == Setup(Robot(gyro_delay=PAPER.gyro_lag), PAPER.calibration)
    assert abs(true.robot.wheel_radius / told.robot.wheel_radius - 1.0) == pytest.approx(0.01)
    assert abs(true.robot.lever_arm[2] - told.robot.lever_arm[2]) == pytest.approx(0.003)
    assert abs(math.degrees(true.robot.mounting[1])) == pytest.approx(0.2)
    signs = {simulate("W2", 0.02, 1.0, seed).true_setup.robot.mounting[1] > 0 for seed in range(8)}
    assert signs == {True, False}


def test_slip_turns_the_wheels_and_moves_nothing():
    slipping, rolling = (
        simulate(world, 0.02, 20.0, 2) for world in (W2, replace(W2, slips_per_second=0.0))
    )
    np.testing.assert_array_equal(slipping.recording.truth.tilt, rolling.recording.truth.tilt)
    slip = slipping.recording.wheels.angle - rolling.recording.wheels.angle
    assert 0.001 < float(np.max(np.abs(slip))) * 0.0375 < 0.1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("mars", 0.002, 1.0, 1), "there is no world 'mars'; there are: ideal, paper"),
        (("paper", 0.0007, 1.0, 1), "0.0007 s is not a multiple of the step 0.0005 s"),
        (("paper", 0.0, 1.0, 1), "not a multiple"),
        (("paper", math.nan, 1.0, 1), "`dt`: nan is no number"),
        (("paper", 0.002, 0.002, 1), "`duration`: 0.002 s is below two periods"),
        (("paper", 0.002, 1.0, -1), "`seed`: -1 is no whole number from 0"),
        (("paper", 0.002, 1.0, 1, "fly"), "there is no scene 'fly'"),
    ],
)
def test_what_cannot_be_simulated_says_why(arguments, message):
    with pytest.raises(ConfigurationError, match=message):
        simulate(*arguments)


def test_a_world_of_one_s_own():
    world = World("mine", "a gyro that reads high", gyro_scale_error=0.1)
    assert simulate(world, 0.01, 2.0, 1).true_setup.calibration.gyro_scale[1] == pytest.approx(
        1.0 / 1.1
    )
