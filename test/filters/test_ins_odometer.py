"""The navigation filter on the simulated rig and on hand-held recordings."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, correct, run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.filters.inertial.strapdown import (
    attitude_at,
    matrix_of,
    tilt_ahead,
    tilt_of,
    turned,
)
from twbr_estimation.imports.imported import ImportOptions, load
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.pipeline.validity import VALID_STDDEV
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import Setup
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample, TiltEstimate
from twbr_estimation.scoring.score import Association, score
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.planar_sensing import gyro_cross
from twbr_estimation.simulation.worlds import world_named

ENTRY = filter_named("ins_odometer")
GYRO = ("gyro_x", "gyro_y", "gyro_z")
UNSEEN = range(3001, 3011)
"""Seeds that were never used to choose a default."""
SEEDS = UNSEEN[:3]


@cache
def drive(world: str, seed: int, dt: float = 0.005) -> tuple[CorrectedTrack, Setup, FloatArray]:
    made = simulate(world, dt, 60.0, seed)
    assert made.recording.truth is not None
    samples = pair(made.recording.imu, made.recording.wheels)
    return correct(samples, made.setup), made.setup, made.recording.truth.tilt


def run(track: CorrectedTrack, setup: Setup, state: Any = None, name: str = "ins_odometer") -> Any:
    entry = filter_named(name)
    return run_filter(entry, entry.configure(), track, setup.robot, state)


def changed(track: CorrectedTrack, name: str, rows: slice, value: float) -> CorrectedTrack:
    columns = track.columns.copy()
    columns[CorrectedSample._fields.index(name), rows] = value
    return CorrectedTrack(track.stamps, columns)


def mse_deg2(error: FloatArray) -> float:
    return float(np.mean(np.degrees(error) ** 2))


def mean_mse(world: str, name: str = "ins_odometer") -> float:
    tracks = [drive(world, seed) for seed in UNSEEN]
    return float(np.mean([mse_deg2(run(t, s, None, name).tilt - truth) for t, s, truth in tracks]))


@pytest.mark.parametrize(
    ("world", "limit"), [("W1", 0.07), ("W2", 0.18), ("W3", 0.25), ("W4", 0.28)]
)
def test_stays_within_the_limit_of_each_world(world: str, limit: float) -> None:
    assert mean_mse(world) < limit


def test_beats_the_complementary_filter_ten_times() -> None:
    assert 10.0 * mean_mse("W1") < mean_mse("W1", "complementary")


def test_rate_beyond_the_range_is_estimated() -> None:
    """The same drive with the excess taken for noise alone would lose several degrees."""
    for seed in SEEDS:
        track, setup, truth = drive("W1", seed)
        saturated = track.field("gyro_saturated_y") > 0.0
        assert saturated.any()
        estimate = run(track, setup)
        after = np.convolve(saturated, np.ones(10), "full")[: saturated.size] > 0
        assert mse_deg2((estimate.tilt - truth)[after]) < 1.0


@pytest.mark.parametrize("world", ["W2", "W3"])
def test_a_gyro_that_was_never_calibrated_is_learnt_in_motion(world: str) -> None:
    """Off by 4 deg/s, thirteen deviations, it pulls aside the vertical wheels are held against."""
    for seed in SEEDS:
        track, setup, truth = drive(world, seed)
        columns = track.columns[:, 1000:].copy()
        for name, sign in zip(GYRO, (-1.0, 1.0, 1.0), strict=True):
            columns[CorrectedSample._fields.index(name)] += math.radians(4.0) * sign
        found = run(CorrectedTrack(track.stamps[1000:], columns), setup)
        error = np.degrees(found.tilt - truth[1000:])
        assert np.mean(error[4000:] ** 2) < 1.0


@pytest.mark.parametrize("wrong", [math.radians(30.0), math.radians(-30.0)])
def test_recovers_from_a_wrong_start_within_two_seconds(wrong: float) -> None:
    for seed in SEEDS:
        track, setup, truth = drive("W1", seed)
        sample = CorrectedSample(*(float(value) for value in track.columns[:, 0]))
        coefficients = ENTRY.derive(ENTRY.configure(), setup.robot)
        start = TiltEstimate(float(truth[0]) + wrong, sample.gyro_y)
        state = ENTRY.reset(start, sample, coefficients)
        rest = CorrectedTrack(track.stamps[1:], np.ascontiguousarray(track.columns[:, 1:]))
        error = run(rest, setup, state).tilt[:500] - truth[1:501]
        assert abs(error[399]) < math.radians(2.0)


def test_without_encoder_it_stays_inertial_and_returns() -> None:
    for seed in SEEDS:
        track, setup, truth = drive("W1", seed)
        third = truth.size // 3
        dropped = changed(track, "wheel_count", slice(third, 2 * third), 0.0)
        error = run(dropped, setup).tilt - truth
        inertial = run(changed(track, "wheel_count", slice(None), 0.0), setup).tilt - truth
        assert mse_deg2(error[third : 2 * third]) < 1.2 * mse_deg2(inertial) + 0.1
        assert mse_deg2(error[2 * third + 400 :]) < 0.2


def test_a_frozen_encoder_is_left_out_until_it_moves() -> None:
    silent, frozen, after = [], [], []
    for seed in SEEDS:
        track, setup, truth = drive("W1", seed)
        third = truth.size // 3
        held = slice(third, 2 * third)
        angle = float(track.field("wheel_angle")[third])
        stuck = changed(track, "wheel_angle", held, angle)
        cut = CorrectedTrack(stuck.stamps[: 2 * third], stuck.columns[:, : 2 * third].copy())
        assert run(cut, setup).state.aiding.wheels == 0.0
        error = run(stuck, setup).tilt - truth
        frozen.append(mse_deg2(error[held]))
        after.append(mse_deg2(error[2 * third + 400 :]))
        dropped = changed(track, "wheel_count", held, 0.0)
        silent.append(mse_deg2((run(dropped, setup).tilt - truth)[held]))
    assert np.mean(frozen) < 1.5 * np.mean(silent) + 0.1
    assert np.mean(after) < 0.15


def test_a_robot_at_rest_has_no_frozen_encoder() -> None:
    made = simulate("W1", 0.005, 20.0, SEEDS[0], "still")
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    end = run(track, made.setup)
    assert end.state.aiding.wheels == 1.0
    assert abs(end.tilt[-1]) < math.radians(0.5)


def test_the_variance_is_that_of_the_error() -> None:
    """Over ten independent drives the mean of error squared over variance; 95 % bounds.

    The filter is given the mounting error of this world, which nothing on board can measure.
    """
    mounting = math.radians(world_named("W2").mounting_error_deg)
    parameters, squares = ENTRY.configure({"mounting": mounting}), []
    for seed in UNSEEN:
        track, setup, truth = drive("W2", seed)
        estimate = run_filter(ENTRY, parameters, track, setup.robot)
        squares.append(np.mean(np.square(estimate.tilt - truth) / estimate.tilt_variance))
    assert 0.32 < np.mean(squares) < 2.05


@pytest.mark.parametrize("wrong", [math.radians(30.0), math.radians(-30.0)])
def test_a_wrong_start_is_known_to_be_uncertain(wrong: float) -> None:
    for seed in SEEDS:
        track, setup, truth = drive("W1", seed)
        sample = CorrectedSample(*(float(value) for value in track.columns[:, 0]))
        coefficients = ENTRY.derive(ENTRY.configure(), setup.robot)
        start = TiltEstimate(float(truth[0]) + wrong, sample.gyro_y)
        state = ENTRY.reset(start, sample, coefficients)
        assert state.tilt_variance > VALID_STDDEV**2
        rest = CorrectedTrack(track.stamps[1:], np.ascontiguousarray(track.columns[:, 1:]))
        estimate = run(rest, setup, state)
        square = np.square(estimate.tilt - truth[1:]) / estimate.tilt_variance
        assert np.mean(square[:400]) < 4.0


@pytest.mark.parametrize(
    ("readings", "stated"),
    [
        ({}, 0.05),
        ({"gyro_y": 0.1}, 0.05),
        ({"gyro_y": 0.2}, 0.3),
        ({"accel_z": 1.03 * STANDARD_GRAVITY}, 0.3),  # 14 deg wrong, if it accelerates forward
        ({"accel_z": 0.5 * STANDARD_GRAVITY}, 2.0),
        ({"angle": 0.03}, 0.3),  # the reading does not show the tilt that it starts from
    ],
)
def test_a_first_reading_of_rest_is_better_known(readings: dict[str, float], stated: float) -> None:
    zeros = dict.fromkeys(CorrectedSample._fields, 0.0)
    rest = {**zeros, "dt": 0.005, "accel_z": STANDARD_GRAVITY}
    sample = CorrectedSample(**{**rest, **readings})
    coefficients = ENTRY.derive(ENTRY.configure(), Setup().robot)
    state = ENTRY.reset(TiltEstimate(0.0, sample.gyro_y), sample, coefficients)
    assert state.tilt_variance == pytest.approx(stated**2)


def test_covariance_stays_a_covariance() -> None:
    for world in ("W1", "W4"):
        track, setup, _ = drive(world, SEEDS[0])
        covariance = run(track, setup).state.covariance
        scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        correlation = covariance / np.outer(scale, scale)
        np.testing.assert_allclose(correlation, correlation.T, rtol=0, atol=1e-6)
        assert np.linalg.eigvalsh(correlation).min() > -1e-6


def test_learns_the_gain_of_the_gyro() -> None:
    """At 5 ms the jumps of the controller fall onto the samples, which costs 0.01 of gain."""
    errors = []
    for seed in UNSEEN:
        track, setup, _ = drive("W1", seed, 0.002)
        gain = run(track, setup).state.navigation.gyro_gain[1]
        errors.append(1.0 + gain - 1.0 / 0.945)
    assert np.sqrt(np.mean(np.square(errors))) < 0.01


def test_learns_what_calibration_left_of_the_accelerometer() -> None:
    """Without a residual, the same filter is worse in W3."""
    figures: dict[float, list[float]] = {0.0: [], 0.03: []}
    for told, found in figures.items():
        for seed in UNSEEN:
            track, setup, truth = drive("W3", seed)
            parameters = ENTRY.configure({"accel_residual": told})
            found.append(mse_deg2(run_filter(ENTRY, parameters, track, setup.robot).tilt - truth))
    assert np.mean(figures[0.03]) < 0.9 * np.mean(figures[0.0])


def test_turning_shows_the_cross_axis_of_the_gyro() -> None:
    world = world_named("W4")
    errors = []
    for seed in UNSEEN:
        track, setup, _ = drive("W4", seed, 0.002)
        found = run(track, setup).state.navigation.gyro_cross
        errors.append(found + gyro_cross(world, seed)[0, 2])
    assert np.sqrt(np.mean(np.square(errors))) < 0.5 * world.gyro_cross_axis


def test_the_gyros_own_delay_is_compensated() -> None:
    made = simulate(replace(world_named("W1"), gyro_lag=0.005), 0.005, 60.0, SEEDS[0])
    assert made.recording.reference is not None
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    untold = replace(made.setup, robot=replace(made.setup.robot, gyro_delay=0.0))
    found = [run(track, setup) for setup in (made.setup, untold)]
    association = Association(made.recording.reference)
    scores = [score(each.stamps, each.tilt, association, 0) for each in found]
    assert abs(scores[0].delay_s) < 0.001
    assert scores[1].delay_s > 0.004
    assert scores[0].mse_deg2 < 0.5 * scores[1].mse_deg2


def test_tilt_ahead_is_where_the_rates_lead_to() -> None:
    attitude, time = attitude_at(0.3, (0.1, 0.2, 0.9)), 0.002
    body = matrix_of(attitude)
    for rate in ((0.5, -2.0, 1.0), (3.0, 40.0, -5.0)):
        later = tilt_of(matrix_of(turned(attitude, rate, rate, time, 0.0)))
        ahead = tilt_ahead(tilt_of(body), body, rate, time)
        assert ahead == pytest.approx(later, abs=0.03 * abs(later - 0.3))
        assert abs(later - 0.3) > 0.003


@pytest.mark.parametrize("tilt", [-3.14159, -1.6, 0.0, 0.7, 3.14159])
@pytest.mark.parametrize("rate", [-24.9, -0.3, 0.0, 1e-9, 24.9, 26.0])
def test_tilt_ahead_is_the_angle_of_the_turned_vertical(tilt: float, rate: float) -> None:
    """By series within a small turn, and by the angle beyond."""
    body = matrix_of(attitude_at(tilt, (0.0, 0.1, 1.0)))
    x, z = body[6] - 0.002 * body[8] * rate, body[8] + 0.002 * body[6] * rate
    ahead = tilt_ahead(tilt_of(body), body, (0.0, rate, 0.0), 0.002)
    assert ahead == pytest.approx(math.atan2(-x, z), abs=1e-12)


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_rate_that_the_gyro_held_is_taken_as_linear(share: float) -> None:
    first, last, time, parts = (0.4, -2.0, 1.0), (-0.6, 3.0, 2.5), 0.04, 400
    held, true, part = share * time, attitude_at(0.3, (0.1, 0.2, 0.9)), time / parts
    waited = turned(true, first, first, held, 0.0)
    rates = np.linspace(first, last, parts + 1).tolist()
    for before, now in pairwise(rates):
        true = turned(true, tuple(before), tuple(now), part, 0.0)
    assert turned(waited, first, last, time - held, held) == pytest.approx(true, abs=3e-5)
    assert turned(waited, first, last, time - held, 0.0) != pytest.approx(true, abs=1e-2)


@pytest.mark.parametrize(("dt", "every"), [(0.005, 2), (0.005, 4), (0.01, 4), (0.002, 5)])
@pytest.mark.parametrize("held", [("gyro",), ("accel", "angle"), ("gyro", "accel", "angle")])
def test_sensors_may_be_slower_than_the_samples(
    held: tuple[str, ...], dt: float, every: int
) -> None:
    """What repeats is an instant's reading: the filter waits for the next one."""
    errors, others = [], []
    for seed in (5701, 5702, 5703):
        track, setup, truth = drive("W1", seed, dt)
        columns = track.columns.copy()
        latest = np.arange(columns.shape[1]) // every * every
        for row, name in enumerate(CorrectedSample._fields):
            if name.startswith(held):
                columns[row] = columns[row, latest]
        slow = CorrectedTrack(track.stamps, columns)
        errors.append(mse_deg2(run(slow, setup).tilt - truth))
        others.append(mse_deg2(run(slow, setup, name="complementary").tilt - truth))
    assert np.mean(errors) < 0.2 * np.mean(others)


def test_a_coarse_gyro_is_right_in_its_steps_and_not_slow() -> None:
    """Five degrees per second in a step, as behind a converter of ten bits; means of three."""
    errors = []
    for seed in (5701, 5702, 5703):
        track, setup, truth = drive("W1", seed)
        columns, step = track.columns.copy(), math.radians(5.0)
        for row, name in enumerate(CorrectedSample._fields):
            if name in GYRO:
                columns[row] = step * np.round(columns[row] / step)
        errors.append(mse_deg2(run(CorrectedTrack(track.stamps, columns), setup).tilt - truth))
    assert np.mean(errors) < 0.12


def test_a_silence_counts_whatever_the_reading_after_it() -> None:
    """A reading that repeats the last one before a silence does not put off what that hid."""
    track, setup, _ = drive("W1", 5701)
    columns, at = track.columns.copy(), 4000
    for row, name in enumerate(CorrectedSample._fields):
        if name.startswith(("gyro", "accel", "angle")):
            columns[row, at] = columns[row, at - 1]
    columns[CorrectedSample._fields.index("dt"), at] = 0.09
    found = run(CorrectedTrack(track.stamps, columns), setup).tilt_variance
    assert found[at] > found[at - 1] + np.radians(0.3) ** 2


def broad_figures(shared_data: Path, *, wheels: bool) -> list[float]:
    figures = []
    for trial in sorted((shared_data / "broad_translation").glob("*.mat")):
        for axis in "yx":
            log = load(trial, "broad", ImportOptions(axis=axis))
            assert log.recording.reference is not None
            setup = Setup(log.robot, log.calibration)
            samples = pair(log.recording.imu, log.recording.wheels if wheels else None)
            track = run(correct(samples, setup), setup)
            association = Association(log.recording.reference)
            figures.append(score(track.stamps, track.tilt, association, 0).mse_deg2)
    return figures


def test_hand_held_motion_with_virtual_wheels(shared_data: Path) -> None:
    figures = broad_figures(shared_data, wheels=True)
    assert np.mean(figures) < 0.038
    assert max(figures) < 0.075


def test_hand_held_motion_without_wheels(shared_data: Path) -> None:
    assert np.mean(broad_figures(shared_data, wheels=False)) < 0.052


@pytest.mark.parametrize(("speed", "limit"), [("slow", 0.528), ("medium", 0.641)])
def test_on_a_motor_shaft_it_beats_a_tuned_complementary_filter(
    shared_data: Path, speed: str, limit: float
) -> None:
    """The limits are a complementary filter's with the time constant that suits each file best."""
    log = load(
        shared_data / "uiuc_mpu6050_encoder" / f"raw_pitch_{speed}.mat", "uiuc", ImportOptions()
    )
    assert log.recording.reference is not None
    setup = Setup(log.robot, log.calibration)
    track = run(correct(pair(log.recording.imu, None), setup), setup)
    first = int(log.recording.imu.stamps[0]) + 60_000_000_000
    association = Association(log.recording.reference)
    assert score(track.stamps, track.tilt, association, first).mse_deg2 < limit


def test_without_wheels_a_slow_robot_recovers_sooner() -> None:
    slow, fast = [], []
    for seed in UNSEEN:
        track, setup, truth = drive("W1", seed)
        track = changed(track, "wheel_count", slice(None), 0.0)
        any_speed = ENTRY.configure({"speed": 100.0})
        slow.append(mse_deg2(run(track, setup).tilt - truth))
        fast.append(mse_deg2(run_filter(ENTRY, any_speed, track, setup.robot).tilt - truth))
    assert np.mean(slow) < 0.98 * np.mean(fast)
