"""The default filter on a robot's hard days: never much worse than without its wheels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from twbr_estimation.batch import CorrectedTrack, correct, run_filter
from twbr_estimation.batch.judging import trusted
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import FloatArray, ImuTrack, WheelTrack
from twbr_estimation.robot import Robot
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.hard_days import DAYS, Day
from twbr_estimation.simulation.hard_days.day import balancing, clock, ramp, recorded
from twbr_estimation.simulation.hard_days.prescribed import Motion, planar, rolled_angle

SEED = 4001
"""Never used to choose a constant."""
IN_MOTION = 8101
"""The robot is pushed within its first tenth of a second; this seed has been looked at."""
DRIFTING = 9861
"""A seed of drifts that has chosen no constant either; 4001 to 4004 have."""
COUNT = 2.0 * np.pi / 1320.0
"""Of an encoder [rad]."""
FLOOR, ROOM = 1.2, 0.03
"""Factor and addition [deg^2] within which the filter must be of the best of its rivals."""


@cache
def day(name: str, dt: float, seed: int = SEED) -> tuple[Day, CorrectedTrack, CorrectedTrack]:
    made = DAYS[name](seed, dt)
    imu = made.recording.imu
    tracks = [correct(pair(imu, wheels), made.setup) for wheels in (made.recording.wheels, None)]
    return made, tracks[0], tracks[1]


def errors(name: str, made: Day, track: CorrectedTrack) -> tuple[FloatArray, FloatArray]:
    """Return error [deg] and variance [rad^2] of a filter."""
    entry, truth = filter_named(name), made.recording.truth
    assert truth is not None
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    return np.degrees(np.angle(np.exp(1j * (found.tilt - truth.tilt)))), found.tilt_variance


@pytest.mark.parametrize("dt", [0.005, 0.01])
def test_a_gyro_that_drifts_is_found_out_without_wheels(dt: float) -> None:
    """The mean force stays aside: an error of 6 deg, stated as 0.6, once stayed for good."""
    made, _, blind = day("gyro bias drifts 2 deg/s", dt, DRIFTING)
    error, variance = errors("ins_odometer", made, blind)
    assert np.mean(error**2) < 2.2
    assert np.abs(error[-round(10.0 / dt) :]).max() < 1.0
    assert np.mean(np.radians(error) ** 2 / variance) < 3.0


@pytest.mark.parametrize("dt", [0.005, 0.01])
@pytest.mark.parametrize(
    "name",
    [
        "carried, wheels stand",
        "carried, one encoder",
        "carried, wheels run",
        "lifted 2 s, wheels run",
        "starts lying",
        "wheels spun in the hand",
        "left encoder frozen",
        "48 counts a turn",
        "200 counts a turn",
        "encoder 20 to 60 ms late",
        "leans motionless for 5 min",
        "into a wall",
        "turned on a shaft, no wheels",
        "spins, sensor 20 mm aside",
        "spins beyond the gyro's range",
        "spins beyond it, one encoder",
        "drives round corners",
        "gyro bias drifts 2 deg/s",
        "sensors read every 20 ms",
        "first sample zeros",
        "falls and is put up",
    ],
)
def test_no_worse_than_the_best_that_could_be_had(name: str, dt: float) -> None:
    made, wheels, blind = day(name, dt)
    ours = np.mean(errors("ins_odometer", made, wheels)[0] ** 2)
    rivals = (
        np.mean(errors("ins_odometer", made, blind)[0] ** 2),
        np.mean(errors("complementary", made, wheels)[0] ** 2),
    )
    assert ours < FLOOR * min(rivals) + ROOM


@pytest.mark.parametrize("seed", [SEED, IN_MOTION])
@pytest.mark.parametrize(
    "name",
    [
        "encoder signs wrong",
        "counts doubled",
        "counts halved",
        "degrees for radians",
        "left encoder mirrored",
        "encoder 20 to 60 ms late",
    ],
)
def test_wrong_encoders_are_found_out(name: str, seed: int) -> None:
    made, wheels, blind = day(name, 0.005, seed)
    ours = np.mean(errors("ins_odometer", made, wheels)[0] ** 2)
    assert ours < FLOOR * np.mean(errors("ins_odometer", made, blind)[0] ** 2) + ROOM


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_counts_that_are_wrong_are_found_out_at_a_crawl(factor: float) -> None:
    """Too slow to prove anything, the wheels push the gyro's bias to and fro."""
    for seed in (9821, 9823, 9825):
        random, robot = np.random.default_rng(seed), Robot()
        step, time = clock(0.005, 60.0)
        tilt, ahead = balancing(time, random)
        slow = planar(step, tilt, 0.5 * ahead)
        angle = factor * rolled_angle(slow, 0.5 * ahead, robot)
        made = recorded("crawls", slow, angle, robot, 0.005, seed)
        track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
        error, _ = errors("ins_odometer", made, track)
        assert np.mean(error**2) < 0.1


@pytest.mark.parametrize("seed", [8307, 8308])
def test_a_walk_is_no_lean_for_a_gyro_whose_bias_was_known(seed: int) -> None:
    """Right wheels have taught the bias before the robot is carried away."""
    made, wheels, blind = day("carried straight ahead", 0.005, seed)
    ours = np.mean(errors("ins_odometer", made, wheels)[0] ** 2)
    assert ours < FLOOR * np.mean(errors("ins_odometer", made, blind)[0] ** 2) + ROOM


def test_wheels_that_turn_slowly_on_the_spot_do_not_push_the_bias_about() -> None:
    """They were right before, and turn too slowly for the check of velocities."""
    made, wheels, _ = day("held against a wall", 0.01, 9301)
    assert np.mean(errors("ins_odometer", made, wheels)[0] ** 2) < 0.17


@pytest.mark.parametrize("with_wheels", [True, False])
def test_a_first_reading_that_points_down_is_found_out(with_wheels: bool) -> None:
    """A chip that is mounted right sends one reading upside down; then the robot rocks."""
    step, time = clock(0.005, 20.0)
    robot, tilt = Robot(), np.radians(3.0) * np.sin(4.0 * time)
    motion = planar(step, tilt, np.zeros_like(time))
    made = recorded("down", motion, rolled_angle(motion, 0.0 * time, robot), robot, 0.005, SEED)
    imu, truth, entry = made.recording.imu, made.recording.truth, filter_named("ins_odometer")
    assert truth is not None
    accel = imu.accel.copy()
    accel[0] = 0.0, 0.0, -9.8
    wheels = made.recording.wheels if with_wheels else None
    track = correct(pair(ImuTrack(imu.stamps, imu.gyro, accel), wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, robot)
    true = np.interp(found.stamps, truth.stamps, truth.tilt)
    error = np.degrees(np.abs(np.angle(np.exp(1j * (found.tilt - true)))))
    assert error[0] > 170.0
    assert not np.any(trusted(entry, track, found) & (error > 5.0))
    assert error[found.stamps - found.stamps[0] > 3_000_000_000].max() < 5.0


@pytest.mark.parametrize("factor", [0.5, 0.7, 1.3, 2.0])
def test_an_accelerometer_of_a_wrong_full_scale_is_followed_but_not_trusted(factor: float) -> None:
    made, entry = simulate("W1", 0.005, 20.0, SEED), filter_named("ins_odometer")
    imu, truth = made.recording.imu, made.recording.truth
    assert truth is not None
    scaled = ImuTrack(imu.stamps, imu.gyro, factor * imu.accel)
    track = correct(pair(scaled, None), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    error = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    assert np.mean(trusted(entry, track, found)) < 0.2
    assert np.abs(error).max() < 15.0


@pytest.mark.parametrize("seed", range(9811, 9814))
def test_a_swing_from_the_first_sample_on_is_followed_without_wheels(seed: int) -> None:
    """A pendulum below a fixed axle: it is the axle that is slow, not the sensor."""
    robot = Robot(lever_arm=(0.0, 0.0, -0.165), gyro_range=35.0, accel_range=160.0)
    step, time = clock(0.01, 30.0)
    tilt = np.radians(30.0) * np.exp(-time / 40.0) * np.sin(2.0 * np.pi * time)
    made = recorded("swings", planar(step, tilt, 0.0 * time), None, robot, 0.01, seed)
    track = correct(pair(made.recording.imu, None), made.setup)
    ours, rival = (errors(name, made, track)[0] for name in ("ins_odometer", "complementary"))
    assert np.mean(ours**2) < 0.5 * np.mean(rival**2)


@pytest.mark.parametrize("with_wheels", [True, False])
@pytest.mark.parametrize("spike", [1.75, 8.7])
def test_a_first_reading_of_the_gyro_that_is_wrong_is_no_swing(
    spike: float, with_wheels: bool
) -> None:
    """All axes of it read 100 or 500 deg/s of a robot that stands, and then drives."""
    made = simulate("W1", 0.005, 10.0, 9871)
    recording = made.recording
    gyro = recording.imu.gyro.copy()
    gyro[0] = spike
    imu = ImuTrack(recording.imu.stamps, gyro, recording.imu.accel)
    track = correct(pair(imu, recording.wheels if with_wheels else None), made.setup)
    entry, truth = filter_named("ins_odometer"), recording.truth
    assert truth is not None
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    error = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    assert np.abs(error).max() < 4.0


@pytest.mark.parametrize("world", ["W2", "W3", "W4"])
def test_right_wheels_are_believed_while_all_axes_of_the_gyro_drift(world: str) -> None:
    """By 2 deg/s within 20 s; what it does to roll and heading is no error of the wheels."""
    made, entry = simulate(world, 0.005, 60.0, DRIFTING), filter_named("ins_odometer")
    imu, truth = made.recording.imu, made.recording.truth
    assert truth is not None
    time = (imu.stamps - imu.stamps[0]) * 1e-9
    signs = np.random.default_rng(DRIFTING).choice([-1.0, 1.0], 3)
    drift = np.radians(2.0) * signs * np.clip((time - 15.0) / 20.0, 0.0, 1.0)[:, None]
    warming = ImuTrack(imu.stamps, imu.gyro + drift, imu.accel)
    track = correct(pair(warming, made.recording.wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    assert entry.wheels_ignored is not None and entry.wheels_ignored(found.state) == 0.0
    error = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    assert np.mean(error**2) < 0.25


def test_two_early_slips_do_not_lead_to_right_wheels_being_ignored() -> None:
    """They slip at half a second and a second; a gain of the gyro of 18 % explained that."""
    made, entry = simulate("W2", 0.005, 10.0, 3008), filter_named("ins_odometer")
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    assert entry.wheels_ignored is not None and entry.wheels_ignored(found.state) == 0.0


def misread(angle: FloatArray) -> FloatArray:
    """Return an encoder that says 1000 counts more now and then, for one sample."""
    rng, read = np.random.default_rng(9871), angle.copy()
    read[rng.integers(1000, len(angle), 8), rng.integers(0, angle.shape[1], 8)] += 1000 * COUNT
    return read


def begun_again(angle: FloatArray) -> FloatArray:
    """Return an encoder whose counter begins again at zero twice."""
    read = angle.copy()
    for at in (3300, 5700):
        read[at:] -= read[at]
    return read


@pytest.mark.parametrize("reading", [misread, begun_again])
@pytest.mark.parametrize("world", ["W1", "W2"])
def test_a_count_that_no_wheel_can_make_says_nothing_against_the_wheels(
    world: str, reading: Callable[[FloatArray], FloatArray]
) -> None:
    made, entry = simulate(world, 0.005, 40.0, 9871), filter_named("ins_odometer")
    wheels, truth = made.recording.wheels, made.recording.truth
    assert wheels is not None and truth is not None

    def error(angle: FloatArray) -> float:
        track = correct(pair(made.recording.imu, WheelTrack(wheels.stamps, angle)), made.setup)
        found = run_filter(entry, entry.configure(), track, made.setup.robot)
        assert entry.wheels_ignored is not None and entry.wheels_ignored(found.state) == 0.0
        off = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
        return float(np.mean(off**2))

    assert error(reading(wheels.angle)) < 1.1 * error(wheels.angle) + 0.01


LATE = pytest.param(
    "encoder 20 to 60 ms late",
    marks=pytest.mark.xfail(
        strict=True, reason="late wheels in slow motion pass for right ones: 0.15 %"
    ),
)


@pytest.mark.parametrize("name", [LATE if name == LATE.values[0] else name for name in DAYS])
def test_what_is_called_valid_is_not_far_wrong(name: str) -> None:
    """Less than a thousandth of the samples is more than 5 deg wrong and called valid."""
    made, wheels, _ = day(name, 0.01)
    entry, truth = filter_named("ins_odometer"), made.recording.truth
    assert truth is not None
    found = run_filter(entry, entry.configure(), wheels, made.setup.robot)
    true = np.interp(found.stamps, truth.stamps, truth.tilt)
    far = np.abs(np.angle(np.exp(1j * (found.tilt - true)))) > np.radians(5.0)
    assert np.mean(trusted(entry, wheels, found) & far) < 1e-3


@pytest.mark.parametrize(
    ("name", "seed", "with_wheels", "valid_share"),
    [
        ("encoder signs wrong", 8101, True, 0.65),
        ("encoder signs wrong", 8101, False, 0.7),
        ("encoder signs wrong", 8103, True, 0.7),
        ("encoder signs wrong", 8103, False, 0.8),
        ("degrees for radians", 8101, True, 0.65),
        ("encoder 20 to 60 ms late", 8101, True, 0.65),
        ("counts halved", 8102, True, 0.6),  # the gyro was given a gain of -0.28
    ],
)
def test_what_misleads_from_the_start_is_not_called_valid_too_early(
    name: str, seed: int, with_wheels: bool, valid_share: float
) -> None:
    made, entry = DAYS[name](seed, 0.005), filter_named("ins_odometer")
    recording, truth = made.recording, made.recording.truth
    assert truth is not None
    track = correct(pair(recording.imu, recording.wheels if with_wheels else None), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    far = np.abs(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt)) > np.radians(5.0)
    valid = trusted(entry, track, found)
    assert np.mean(valid & far) < 1e-3
    assert np.mean(valid) > valid_share


@pytest.mark.parametrize(
    ("name", "dt"),
    [
        ("thrown on a pivot", 0.005),
        ("thrown on a pivot", 0.01),
        ("thrown on its wheels", 0.005),
        ("thrown on its wheels", 0.01),
        ("falls and is put up", 0.005),
        ("falls and is put up", 0.01),
        ("falls, its motors stay on", 0.005),
        ("falls, its motors stay on", 0.01),
    ],
)
def test_half_a_second_after_a_fall_the_tilt_is_known(name: str, dt: float) -> None:
    made, wheels, _ = day(name, dt)
    error, _ = errors("ins_odometer", made, wheels)
    time = (made.recording.imu.stamps - made.recording.imu.stamps[0]) * 1e-9
    for begin, end in made.rests:
        assert np.abs(error[(time > begin + 0.5) & (time < end)]).max() < 2.0


def test_a_fall_is_over_a_tenth_of_a_second_after_it() -> None:
    """Where clipped readings leave 35 deg unknown, so much quiet is rest."""
    for dt in (0.005, 0.01):
        made, wheels, _ = day("thrown on a pivot", dt, 4002)
        error, _ = errors("ins_odometer", made, wheels)
        time = (made.recording.imu.stamps - made.recording.imu.stamps[0]) * 1e-9
        for begin, end in made.rests:
            assert np.abs(error[(time > begin + 0.1) & (time < end)]).max() < 5.0


def test_wheels_that_race_in_a_fall_are_not_much_worse_than_none() -> None:
    """A mean over falls: what turns, wheels or body, is unknown while the gyro is clipped."""
    means = []
    for seed in (SEED, 4002, 4003):
        made, wheels, blind = day("falls, its motors stay on", 0.005, seed)
        found = (errors("ins_odometer", made, each)[0] for each in (wheels, blind))
        means.append([np.mean(error**2) for error in found])
    ours, blind_mean = np.mean(means, axis=0)
    assert ours < 2.5 * blind_mean


def test_how_fast_it_spins_is_known_from_its_lean() -> None:
    """At this seed the wheels alone show it badly."""
    made, wheels, _ = day("spins beyond it, one encoder", 0.005, 9404)
    ours = np.mean(errors("ins_odometer", made, wheels)[0] ** 2)
    assert ours < FLOOR * np.mean(errors("complementary", made, wheels)[0] ** 2) + ROOM


@pytest.mark.parametrize("encoders", [0, 1])
@pytest.mark.parametrize("seed", range(9801, 9805))
def test_a_spin_in_a_slanting_hand_turns_nothing_upside_down(seed: int, encoders: int) -> None:
    """It leans aside by 20 deg, which no robot on its wheels does, and the gyro is clipped."""
    random, robot = np.random.default_rng(seed), Robot(gyro_range=4.36)
    step, time = clock(0.005, 30.0)
    tilt, ahead = balancing(time, random)
    roll = np.radians(20.0) * (ramp(time, 9.0, 10.0) - ramp(time, 24.0, 25.0))
    turning = random.uniform(7.0, 11.0) * (ramp(time, 10.0, 10.5) - ramp(time, 15.0, 15.5))
    yaw = np.cumsum(turning - np.roll(turning, round(8.0 / step))) * step
    east, north = (np.cumsum(np.gradient(ahead) * part) for part in (np.cos(yaw), np.sin(yaw)))
    motion = Motion(step, tilt, roll, yaw, np.stack([east, north, np.zeros_like(tilt)], axis=1))
    wheels = rolled_angle(motion, ahead, robot) if encoders else None
    made = recorded("spins aslant", motion, wheels, robot, 0.005, seed)
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    error, _ = errors("ins_odometer", made, track)
    assert np.abs(error).max() < 60.0


def test_a_yaw_rate_that_sticks_at_full_scale_is_not_called_valid_and_wrong() -> None:
    """One axis of the gyro fails; nothing spins."""
    made, entry = simulate("W1", 0.005, 20.0, SEED), filter_named("ins_odometer")
    imu, truth = made.recording.imu, made.recording.truth
    assert truth is not None
    gyro = imu.gyro.copy()
    gyro[gyro.shape[0] // 2 :, 2] = made.setup.robot.gyro_range
    stuck = ImuTrack(imu.stamps, gyro, imu.accel)
    track = correct(pair(stuck, made.recording.wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    error = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    assert np.mean(trusted(entry, track, found) & (np.abs(error) > 5.0)) < 1e-3


@pytest.mark.parametrize("lying", [180.0, -179.97])
def test_wheels_of_a_robot_that_lies_on_its_head_are_not_ignored(lying: float) -> None:
    """Its tilt passes half a turn with every other sample; then it is put upright and drives."""
    random, robot = np.random.default_rng(SEED), Robot(gyro_range=9.0)
    step, time = clock(0.005, 20.0)
    tilt, ahead = balancing(time, random)
    up, free = ramp(time, 4.0, 5.5), ramp(time, 5.5, 6.0)
    ahead = np.cumsum(np.gradient(ahead) * free)
    motion = planar(step, (1.0 - up) * np.radians(lying) + free * tilt, ahead)
    made = recorded("head", motion, rolled_angle(motion, ahead, robot), robot, 0.005, SEED)
    entry = filter_named("ins_odometer")
    track = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, robot)
    assert entry.wheels_ignored is not None and entry.wheels_ignored(found.state) == 0.0


@pytest.mark.parametrize(
    ("name", "seconds"), [("ins_odometer", 0.05), ("ins_odometer", 0.3), ("complementary", 0.3)]
)
def test_a_chip_that_loses_its_supply_is_not_believed(name: str, seconds: float) -> None:
    """It sends zeros at times, which look like a fall without turning, less the biases."""
    made = DAYS["accelerometer 15 mg off"](SEED, 0.005)
    imu, truth, entry = made.recording.imu, made.recording.truth, filter_named(name)
    assert truth is not None
    time = (imu.stamps - imu.stamps[0]) * 1e-9
    silent = (time > 5.0) & (time % 10.0 < seconds)
    gyro, accel = imu.gyro.copy(), imu.accel.copy()
    gyro[silent] = accel[silent] = 0.0
    track = correct(pair(ImuTrack(imu.stamps, gyro, accel), made.recording.wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    error = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    wrong = (np.abs(error) > 5.0) & trusted(entry, track, found)
    assert wrong.mean() < 0.001


@pytest.mark.parametrize("asleep", [1, 3, 20])
def test_readings_of_a_chip_that_wakes_up_are_not_trusted(asleep: int) -> None:
    """The first samples are all zeros; the next one shows where down is."""
    made, _, _ = day("first sample zeros", 0.005)
    imu, truth, entry = made.recording.imu, made.recording.truth, filter_named("ins_odometer")
    assert truth is not None
    gyro, accel = imu.gyro.copy(), imu.accel.copy()
    gyro[:asleep] = accel[:asleep] = 0.0
    woken = ImuTrack(imu.stamps, gyro, accel)
    track = correct(pair(woken, made.recording.wheels), made.setup)
    found = run_filter(entry, entry.configure(), track, made.setup.robot)
    error = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    assert np.abs(error[asleep:]).max() < 5.0
    assert not trusted(entry, track, found)[:asleep].any()
