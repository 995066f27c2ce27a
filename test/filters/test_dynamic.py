"""The filters with a model of the robot, where they have one and where they have not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, correct, run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.filters.model_based.engine import Coefficients
from twbr_estimation.filters.model_based.model import forward_force, predicted
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.plants.sihite2018 import (
    Commands,
    SpatialState,
    accelerations,
    advance,
    spatial_parameters,
    specific_force,
)
from twbr_estimation.robot import Robot
from twbr_estimation.samples import MOTORS, WHEELS, CorrectedSample, TiltEstimate
from twbr_estimation.simulation.spinning import EDUMIP_ROBOT, SpinSensor, Spun, spin

NAMES = ("dynamic_planar", "dynamic_yaw", "dynamic_calibrating")
DT = 0.005
LAST = slice(2000, None)

WHEEL_ROWS = [CorrectedSample._fields.index(name) for name in WHEELS]
MOTOR_ROWS = [CorrectedSample._fields.index(name) for name in MOTORS]
every_dynamic = pytest.mark.parametrize("name", NAMES)


def coefficients(name: str, robot: Robot = EDUMIP_ROBOT, **values: float) -> Coefficients:
    entry = filter_named(name)
    derived: Coefficients = entry.derive(entry.configure(values), robot)
    return derived


def sample(**fields: float) -> CorrectedSample:
    zeros = dict.fromkeys(CorrectedSample._fields, 0.0)
    return CorrectedSample(**{**zeros, "dt": DT, **fields})


def track_of(spun: Spun) -> CorrectedTrack:
    recording = spun.recording
    return correct(pair(recording.imu, recording.wheels, motors=recording.motors), spun.setup)


def error(name: str, spun: Spun, track: CorrectedTrack | None = None, **values: float):
    entry, reference = filter_named(name), spun.recording.reference
    assert reference is not None
    track = track or track_of(spun)
    estimates = run_filter(entry, entry.configure(values), track, spun.setup.robot)
    assert np.isfinite(estimates.columns).all()
    return estimates.tilt - np.interp(track.stamps, reference.stamps, reference.tilt)


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.fixture(scope="module")
def clean() -> Spun:
    """A spin at 10 rad/s with an IMU that sits where it is said to sit."""
    return spin(10.0, SpinSensor(offset=0.0), 20.0, 401)


@pytest.fixture(scope="module")
def wrong() -> Spun:
    """The same with an IMU off the axle's plane, cross-axis and mounting errors."""
    return spin(10.0, SpinSensor(gyro_cross_axis=0.002, mounting_error=0.012), 20.0, 402)


@every_dynamic
def test_the_slopes_are_those_of_the_prediction(name: str) -> None:
    c = coefficients(name)
    random = np.random.default_rng(1)
    for row in random.normal(size=(10, 12)):
        x = row[: len(c.noise.first)] * np.r_[0.2, 1, 1, 1, 10, 5, 0, 0, 0, 0][: len(c.noise.first)]
        given = sample(voltage=float(row[10]), voltage_difference=float(row[11]))
        if c.model.turns == 0.0:
            x[5] = 0.0
        slopes = predicted(x, given, c.model)[1]
        for j in range(x.size):
            if c.model.turns == 0.0 and j == 5:
                continue
            step = np.zeros(x.size)
            step[j] = 1e-6
            after, before = (predicted(x + s * step, given, c.model)[0] for s in (1.0, -1.0))
            np.testing.assert_allclose(slopes[:, j], (after - before) / 2e-6, atol=1e-6)


def test_the_prediction_is_the_robots_motion() -> None:
    """A small motion for 0.1 s, against the nonlinear plant."""
    p, c = spatial_parameters(EDUMIP_ROBOT), coefficients("dynamic_calibrating")
    state = SpatialState(0.03, 0.2, 0.4, -0.1, 1.0, 6.0)
    x, commands = np.r_[np.array(state), np.zeros(4)], Commands(0.4, 0.3)
    given = sample(dt=0.001, voltage=0.4, voltage_difference=0.6)
    for _ in range(100):
        state, x = advance(state, commands, p, 0.001), predicted(x, given, c.model)[0]
    np.testing.assert_allclose(x[:6], state, rtol=5e-3, atol=2e-4)


def test_the_force_is_what_the_imu_measures() -> None:
    p = spatial_parameters(EDUMIP_ROBOT)
    robot = replace(EDUMIP_ROBOT, lever_arm=(0.01, 0.0, 0.06))
    model = coefficients("dynamic_yaw", robot).model
    state, commands = SpatialState(0.02, 0.0, 0.0, 0.0, 2.0, 8.0), Commands(0.5, 0.1)
    expected, _ = forward_force(np.array(state), commands.forward, model)
    felt = specific_force(state, accelerations(state, commands, p), robot.lever_arm, p)
    assert felt[0] == pytest.approx(expected, abs=5e-3)


@every_dynamic
def test_noise_at_the_printed_period(name: str) -> None:
    printed = {
        "dynamic_planar": ([1e-11, 1e-7, 1e-5, 1e-7], [1e-5, 3.07e-6, 3.04e-3]),
        "dynamic_yaw": ([1e-11, 1e-7, 1e-7, 1e-5, 1e-7, 1e-7], [1e-5, 2.62e-7, 5.44e-3, 1e-5]),
    }
    if name not in printed:
        pytest.skip("not the paper's")
    process, measured = printed[name]
    noise = coefficients(name).noise
    growth = [DT * each for each in noise.growth if each > 0.0]
    np.testing.assert_allclose(growth, process, rtol=5e-3)
    found = [noise.wheel, noise.gyro, noise.accel, noise.heading][: len(measured)]
    np.testing.assert_allclose(found, measured, rtol=5e-3)


@pytest.mark.parametrize("name", ["dynamic_yaw", "dynamic_calibrating"])
def test_they_follow_a_spin_with_known_parameters(name: str, clean: Spun) -> None:
    assert rms(error(name, clean)[LAST]) < 0.001


def test_only_the_calibrating_one_survives_cross_axis_and_mounting_errors(wrong: Spun) -> None:
    assert rms(error("dynamic_calibrating", wrong)[LAST]) < 0.005
    assert rms(error("dynamic_yaw", wrong)[LAST]) > 0.1
    assert rms(error("dynamic_planar", wrong)[LAST]) > 0.1


def test_what_it_learns_is_what_is_wrong() -> None:
    spun = spin(10.0, SpinSensor(offset=0.0157), 30.0, 403)
    entry = filter_named("dynamic_calibrating")
    state = run_filter(entry, entry.configure(), track_of(spun), spun.setup.robot).state
    assert state.core.x[9] == pytest.approx(0.0157, abs=0.001)
    assert abs(state.core.x[7]) < 5e-4


@every_dynamic
def test_without_motors_it_goes_by_gyro_and_angle(name: str, clean: Spun) -> None:
    track = track_of(clean)
    blind = track.columns.copy()
    blind[MOTOR_ROWS] = 0.0
    rows = CorrectedTrack(track.stamps, blind)
    without_motors = error(name, clean, rows)
    blind = track.columns.copy()
    blind[WHEEL_ROWS] = 0.0
    without_wheels = error(name, clean, CorrectedTrack(track.stamps, blind))
    np.testing.assert_array_equal(without_motors, without_wheels)
    assert rms(without_motors[LAST]) < 0.03


@every_dynamic
def test_wheels_that_come_and_go(name: str, clean: Spun) -> None:
    """The paper's filters trust their model at once, pushes or not, and jump."""
    track = track_of(clean)
    columns = track.columns.copy()
    columns[WHEEL_ROWS, 1000:1200] = 0.0
    columns[WHEEL_ROWS[0], 1200:] += 7.0  # the driver has begun again
    columns[WHEEL_ROWS, 2600:2601] = 0.0
    found = error(name, clean, CorrectedTrack(track.stamps, columns))
    jump = 0.002 if name == "dynamic_calibrating" else 0.03
    assert np.max(np.abs(np.diff(found[900:]))) < jump
    assert rms(found[LAST]) < 0.01


@every_dynamic
def test_pauses_and_one_lost_sample_in_five(name: str, clean: Spun) -> None:
    track = track_of(clean)
    kept = np.random.default_rng(1).random(track.stamps.size) > 0.2
    kept[1500:1540] = False
    kept[0] = True
    columns = track.columns[:, kept].copy()
    columns[0, 1:] = np.diff(track.stamps[kept]) * 1e-9
    found = error(name, clean, CorrectedTrack(track.stamps[kept], columns))
    assert rms(found[1800:]) < 0.01


@every_dynamic
def test_a_fall_ends_the_model_and_standing_up_begins_it(name: str) -> None:
    """Lying for 3 s with the motors running, unknown to the filter, then upright at rest."""
    entry = filter_named(name)
    robot, tilts = Robot(), np.concatenate([np.full(600, 1.2), np.zeros(2000)])
    coefficient = entry.derive(entry.configure(), robot)
    first = sample(angle=1.2, angle_variance=1e-4, accel_z=9.8, dt=0.0)
    state = entry.reset(TiltEstimate(0.0, 0.0), first, coefficient)
    for index, tilt in enumerate(tilts.tolist()):
        lying = tilt > 0.5
        given = sample(
            angle=tilt,
            angle_variance=1e-4,
            accel_x=-robot_gravity() * math.sin(tilt),
            accel_z=robot_gravity() * math.cos(tilt),
            gyro_y=-2.4 if 550 <= index < 650 else 0.0,
            wheel_count=1.0,
            wheel_angle=0.1 * index if lying else 60.0,
            motor_count=1.0,
            voltage=5.0 if lying else 0.0,
            gyro_variance_y=3e-6,
            accel_variance_x=2e-3,
        )
        state = entry.step(state, given, coefficient)
        assert math.isfinite(state.tilt + state.rate + state.tilt_variance)
        if index == 540:
            assert state.tilt == pytest.approx(1.2, abs=0.02)
    assert state.tilt == pytest.approx(0.0, abs=0.02)


def robot_gravity() -> float:
    return spatial_parameters(Robot()).gravity


def test_an_encoder_on_the_ground_gives_the_same(clean: Spun) -> None:
    recording, reference = clean.recording, clean.recording.reference
    assert recording.wheels is not None and reference is not None
    wheels = replace(recording.wheels, angle=recording.wheels.angle + reference.tilt[:, None])
    robot = replace(clean.setup.robot, encoder_placement="ground")
    other = Spun(replace(recording, wheels=wheels), replace(clean.setup, robot=robot))
    difference = error("dynamic_yaw", other) - error("dynamic_yaw", clean)
    assert np.max(np.abs(difference[LAST])) < 1e-3


def test_one_command_for_both_motors_and_one_encoder_take_the_yaw_from_the_gyro(
    clean: Spun,
) -> None:
    track = track_of(clean)
    columns = track.columns.copy()
    columns[WHEEL_ROWS[1:]] = [[0.0], [1.0]]
    columns[MOTOR_ROWS[1:]] = [[0.0], [1.0]]
    found = error("dynamic_calibrating", clean, CorrectedTrack(track.stamps, columns))
    assert rms(found[LAST]) < 0.006
