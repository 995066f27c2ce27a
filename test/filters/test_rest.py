"""Rest of a body whose gyro has a bias, and motions that look like rest to both sensors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from twbr_estimation.batch import CorrectedTrack, correct, run_filter
from twbr_estimation.batch.judging import trusted
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample
from twbr_estimation.simulation.hard_days.day import DEGREE, Day, between, clock, ramp, recorded
from twbr_estimation.simulation.hard_days.prescribed import Motion, Sensor, planar, rolled_angle
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream

DT = 0.01
INS = filter_named("ins_odometer")
ROBOT = Robot(
    gyro_range=1000.0 * DEGREE,
    accel_range=8.0 * STANDARD_GRAVITY,
    track_width=0.2,
    lever_arm=(0.0, 0.0, 0.1),
)


def judged(made: Day, track: CorrectedTrack) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the errors of `ins_odometer` [deg], and where a live stream calls it valid."""
    found, truth = run_filter(INS, INS.configure(), track, made.setup.robot), made.recording.truth
    assert truth is not None
    true = np.interp(found.stamps, truth.stamps, truth.tilt)
    error = np.degrees(np.angle(np.exp(1j * (found.tilt - true))))
    return error, trusted(INS, track, found)


def at_rest(duration: float, wheels: bool) -> tuple[Day, CorrectedTrack]:
    """Return a day of a robot that stands still."""
    step, time = clock(DT, duration, 2.5e-3)
    turned = np.zeros((time.size, 2)) if wheels else None
    zero = np.zeros_like(time)
    made = recorded("rest", planar(step, zero, zero), turned, ROBOT, DT, 1, Sensor())
    return made, correct(pair(made.recording.imu, made.recording.wheels), made.setup)


def biased(track: CorrectedTrack, bias: float, begin: float) -> CorrectedTrack:
    """Return the samples of a gyro whose pitch axis reads `bias` [rad/s] more from `begin` [s]."""
    columns = track.columns.copy()
    row = CorrectedSample._fields.index("gyro_y")
    columns[row, (track.stamps - track.stamps[0]) * 1e-9 >= begin] += bias
    return CorrectedTrack(track.stamps, columns)


@pytest.mark.parametrize("wheels", [True, False])
@pytest.mark.parametrize(
    ("bias", "begin"), [(0.1, 0.0), (0.17, 0.0), (-0.35, 0.0), (0.12, 5.0), (-0.3, 5.0)]
)
def test_a_large_bias_at_rest_is_never_wrong_and_valid_and_soon_known(
    bias: float, begin: float, wheels: bool
) -> None:
    made, track = at_rest(begin + 3.0, wheels)
    error, valid = judged(made, biased(track, bias, begin))
    time = DT * np.arange(error.size)
    assert not np.any(valid & (np.abs(error) > 5.0))
    after = time > begin + 1.5
    assert valid[after].all()
    assert np.abs(error[after]).max() < 1.0


@pytest.mark.parametrize(("bias", "said"), [(0.03, False), (0.17, True)])
def test_a_large_bias_at_rest_is_named(bias: float, said: bool) -> None:
    made, track = at_rest(1.5, True)
    stream = FilterStream(FilterConfiguration(FilterSettings(INS.name), robot=made.setup.robot))
    for column in biased(track, bias, 0.0).columns.T.tolist():
        stream.step(CorrectedSample(*column))
    assert any("(0.00, 0.17, 0.00) rad/s" in each for each in stream.remarks()) is said


def driven(acceleration: float) -> tuple[Day, CorrectedTrack]:
    """Return a day of an upright robot that drives to and fro, at its hardest [m/s^2] once a s."""
    step, time = clock(DT, 18.0, 2.5e-3)
    hard = acceleration * np.sin(math.pi * time) * ramp(time, 1.0, 2.0)
    upright, ahead = np.zeros_like(time), np.cumsum(np.cumsum(hard)) * step * step
    motion = planar(step, upright, ahead)
    wheel = rolled_angle(motion, ahead, ROBOT)
    made = recorded("to and fro", motion, np.stack([wheel, wheel], axis=1), ROBOT, DT, 1, Sensor())
    return made, correct(pair(made.recording.imu, made.recording.wheels), made.setup)


@pytest.mark.parametrize("begin", [10.2, 10.4, 11.2, 11.5])
def test_a_start_in_an_acceleration_is_no_rest_while_the_wheels_roll(begin: float) -> None:
    """Both sensors are as quiet as at rest for 0.3 s where the acceleration is largest."""
    made, track = driven(4.0)
    late = slice(round(begin / DT), round((begin + 6.0) / DT))
    columns = track.columns[:, late].copy()
    columns[CorrectedSample._fields.index("dt"), 0] = 0.0
    error, valid = judged(made, CorrectedTrack(track.stamps[late], columns))
    assert not np.any(valid & (np.abs(error) > 5.0))
    assert np.mean(valid) > 0.8


@pytest.mark.parametrize("acceleration", [1.5, -1.5, 2.5])
def test_a_robot_on_a_base_that_accelerates_for_two_seconds_does_not_lean(
    acceleration: float,
) -> None:
    """A cart: no wheel turns, and no gyro has seen the turn to where the force points."""
    step, time = clock(DT, 12.0, 2e-3)
    pushed = acceleration * between(time, 5.0, 7.0, 0.3)
    upright, ahead = np.zeros_like(time), np.cumsum(np.cumsum(pushed)) * step * step
    made = recorded("cart", planar(step, upright, ahead), None, ROBOT, DT, 1, Sensor())
    error, valid = judged(made, correct(pair(made.recording.imu, None), made.setup))
    assert not np.any(valid & (np.abs(error) > 5.0))
    assert np.mean(valid) > 0.8


@pytest.mark.parametrize(
    ("acceleration", "speeding", "braking"), [(1.0, 2.0, 8.0), (2.0, 2.0, 2.0), (1.0, 5.0, 5.0)]
)
def test_a_base_that_speeds_up_and_brakes_again_and_again_turns_no_bias(
    acceleration: float, speeding: float, braking: float
) -> None:
    """The navigation's bias swung by 4 deg/s, and the tilt by 15 deg, valid and stated as two."""
    step, time = clock(DT, 60.0, 2e-3)
    pushed, begins, whole = np.zeros_like(time), 8.0, speeding + braking
    while begins + whole < 60.0:
        turns = begins + speeding
        pushed += acceleration * between(time, begins, turns, 0.3)
        pushed -= acceleration * speeding / braking * between(time, turns, begins + whole, 0.3)
        begins += whole + 1.0
    sways = np.radians(2.0) * np.sin(3.5 * time) * np.clip(time - 1.0, 0.0, 1.0)
    ahead = np.cumsum(np.cumsum(pushed)) * step * step
    made = recorded("cart", planar(step, sways, ahead), None, ROBOT, DT, 1, Sensor())
    track = correct(pair(made.recording.imu, None), made.setup)
    error, _ = judged(made, track)
    found, other = run_filter(INS, INS.configure(), track, ROBOT), filter_named("complementary")
    apart = run_filter(other, other.configure(), track, ROBOT).tilt - found.tilt
    assert np.mean(error**2) < np.mean((error + np.degrees(apart)) ** 2)
    assert np.mean(np.radians(error) ** 2 / found.tilt_variance) < 3.0


@pytest.mark.parametrize(("wheels", "largest"), [(True, 0.04), (False, 0.22)])
def test_a_gyro_that_warms_up_is_followed_on_the_spot(wheels: bool, largest: float) -> None:
    """By 1 deg/s within 80 s on all axes; a robot that keeps its place shows nothing else."""
    step, time = clock(DT, 100.0, 2.5e-3)
    starts = np.clip(time - 1.0, 0.0, 1.0)
    ahead = 0.01 * np.sin(1.1 * time) * starts
    motion = planar(step, DEGREE * np.sin(3.5 * time) * starts, ahead)
    turned = rolled_angle(motion, ahead, ROBOT) if wheels else None
    made = recorded("warms up", motion, turned, ROBOT, DT, 1, Sensor())
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    columns, at = track.columns.copy(), (track.stamps - track.stamps[0]) * 1e-9
    for axis in ("gyro_x", "gyro_y", "gyro_z"):
        columns[CorrectedSample._fields.index(axis)] += DEGREE * np.clip((at - 10.0) / 80.0, 0, 1)
    error, valid = judged(made, CorrectedTrack(track.stamps, columns))
    assert np.mean(error**2) < largest
    assert np.mean(valid) > 0.95


@pytest.mark.parametrize("roll", [60.0, -75.0, 83.0])
@pytest.mark.parametrize("period", [0.005, 0.01])
def test_wheels_of_a_robot_on_its_side_move_no_tilt(roll: float, period: float) -> None:
    """It lies there for 8 s, is put up in one, and drives to and fro."""
    step, time = clock(period, 20.0, 2.5e-3)
    ahead = 0.1 * (1.0 - np.cos(3.0 * (time - 10.0))) * ramp(time, 10.0, 11.0)
    zero, side = np.zeros_like(time), roll * DEGREE * (1.0 - ramp(time, 8.0, 9.0))
    motion = Motion(step, zero, side, zero, np.stack([ahead, zero, zero], axis=1))
    wheel = rolled_angle(motion, ahead, ROBOT)
    wheels = np.stack([wheel, wheel], axis=1)
    made = recorded("on its side", motion, wheels, ROBOT, period, 1, Sensor())
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    error, valid = judged(made, track)
    at = period * np.arange(error.size)
    assert np.abs(error[at > 1.0]).max() < 2.0
    assert np.abs(error[at > 10.0]).max() < 0.5
    assert np.mean(valid) > 0.95
    found = run_filter(INS, INS.configure(), track, made.setup.robot)
    assert INS.wheels_ignored is not None and INS.wheels_ignored(found.state) == 0.0
