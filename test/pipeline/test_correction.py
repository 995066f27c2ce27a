"""The correction against noise-free kinematics made without its equations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation import batch
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline import correction
from twbr_estimation.pipeline.coefficients import derive
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.pipeline.pairing import SampleTrack, pair
from twbr_estimation.pipeline.saturation import GYRO_MARK
from twbr_estimation.recording import Recording
from twbr_estimation.robot import Calibration, CorrectionSettings, EncoderPlacement, Robot, Setup
from twbr_estimation.samples import READINGS, STANDARD_GRAVITY, CorrectedSample, Sample
from twbr_estimation.simulation.spinning import EDUMIP_ROBOT, SpinSensor, spin

DT = 1e-4
TIME = np.arange(0.0, 4.0, DT)
ONSET = np.tanh(TIME) ** 3
TILT = 0.5 * np.sin(4.0 * TIME) * ONSET
AXLE = 0.15 * np.sin(5.0 * TIME + 0.3) * ONSET
QUICK = CorrectionSettings(rate_time_constant=1e-3, velocity_time_constant=1e-3)


def moving_robot(robot: Robot) -> SampleTrack:
    """Return what ideal sensors of `robot` report while it swings and drives.

    The specific force is gravity's counterpart plus the second difference of the sensor's
    position in the world, turned into the body; no equation of the correction is used.
    """
    cos, sin = np.cos(TILT), np.sin(TILT)
    forward, up = robot.lever_arm[0], robot.lever_arm[2]
    x = AXLE + cos * forward + sin * up
    z = -sin * forward + cos * up
    force_x = np.gradient(np.gradient(x, DT, edge_order=2), DT, edge_order=2)
    force_z = np.gradient(np.gradient(z, DT, edge_order=2), DT, edge_order=2) + STANDARD_GRAVITY
    columns = np.zeros((len(Sample._fields), TIME.size))
    columns[0, 1:] = DT
    columns[2] = np.gradient(TILT, DT, edge_order=2)
    columns[4] = cos * force_x - sin * force_z
    columns[6] = sin * force_x + cos * force_z
    on_body = robot.encoder_placement is EncoderPlacement.BODY
    columns[7] = AXLE / robot.wheel_radius - (TILT if on_body else 0.0)
    columns[9] = 1.0
    return SampleTrack((TIME * 1e9).round().astype(np.int64), columns)


def angle_error(samples: SampleTrack, setup: Setup) -> float:
    """Return the mean square error of the corrected angle after the start [deg^2]."""
    angle = batch.correct(samples, setup).field("angle")
    late = (TIME > 0.5) & (TIME < 3.99)
    return float(np.mean(np.degrees(angle - TILT)[late] ** 2))


@pytest.mark.parametrize("lever", [(0.0, 0.0, 0.135), (0.0, 0.0, -0.08), (0.05, 0.0, 0.1)])
@pytest.mark.parametrize("placement", list(EncoderPlacement))
def test_all_motion_is_removed(
    lever: tuple[float, float, float], placement: EncoderPlacement
) -> None:
    robot = Robot(lever_arm=lever, encoder_placement=placement)
    assert angle_error(moving_robot(robot), Setup(robot, correction=QUICK)) < 0.01


@pytest.mark.parametrize("term", ["euler", "centrifugal", "wheel"])
def test_each_term_can_be_switched_off_and_matters(term: str) -> None:
    robot = Robot()
    settings = replace(QUICK, **{term: False})
    assert angle_error(moving_robot(robot), Setup(robot, correction=settings)) > 0.05


def test_wrong_encoder_placement_or_lever_sign_is_worse() -> None:
    samples = moving_robot(Robot())
    for wrong in (
        Robot(encoder_placement=EncoderPlacement.GROUND),
        Robot(lever_arm=(0.0, 0.0, -0.135)),
    ):
        assert angle_error(samples, Setup(wrong, correction=QUICK)) > 1.0


def coarse_robot(robot: Robot, counts: float) -> SampleTrack:
    """Return what `robot` reports every 5 ms where its encoder counts so many steps a turn."""
    samples = moving_robot(robot)
    columns = samples.columns[:, ::50].copy()
    columns[0, 1:] = 50.0 * DT
    step = 2.0 * math.pi / counts
    columns[7] = step * np.floor(columns[7] / step)
    return SampleTrack(samples.stamps[::50], columns)


@pytest.mark.parametrize("counts", [12.0, 24.0])
def test_a_coarse_encoder_is_better_than_none(counts: float) -> None:
    entry, errors = filter_named("complementary"), []
    for wheel in (True, False):
        setup = Setup(correction=CorrectionSettings(wheel=wheel))
        corrected = batch.correct(coarse_robot(setup.robot, counts), setup)
        tilt = batch.run_filter(entry, entry.configure({}), corrected, setup.robot).tilt
        errors.append(np.degrees(tilt - TILT[::50])[TIME[::50] > 1.0])
    assert np.std(errors[0]) < 0.7 * np.std(errors[1])


@pytest.mark.parametrize(("radius", "counts"), [(0.3, 24.0), (0.1, 12.0)])
def test_an_encoder_too_coarse_for_any_use_is_not_used(radius: float, counts: float) -> None:
    robot = Robot(wheel_radius=radius)
    samples = coarse_robot(robot, counts)
    found, expected = (
        batch.correct(samples, Setup(robot, correction=CorrectionSettings(wheel=wheel)))
        for wheel in (True, False)
    )
    late = TIME[::50] > 3.0
    np.testing.assert_array_equal(found.field("angle")[late], expected.field("angle")[late])


def upright(**changes: float) -> Sample:
    """Return a sample of a robot at rest, with some fields changed."""
    return Sample(0.002, 0.0, 0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)._replace(**changes)


def test_live_equals_batch_to_the_last_bit() -> None:
    random = np.random.default_rng(5)
    columns = moving_robot(Robot()).columns[:, ::20].copy()
    columns[1:7] += random.normal(0.0, 3.0, columns[1:7].shape)
    columns[0, 1:] = random.uniform(0.001, 0.004, columns.shape[1] - 1)
    columns[0, 700] = 3.0
    columns[7:10, 300:400] = 0.0
    calibration = Calibration(
        gyro_bias=(0.01, -0.03, 0.02),
        gyro_scale=(1.0, 1.02, 1.0),
        accel_bias=(0.1, 0.2, -0.6),
        accel_scale_x=(0.01, 0.002),
        accel_scale_z=(0.1, -0.05, 0.009, -0.0006, 0.00002),
    )
    setup = Setup(Robot(mounting=(0.1, -0.2, 3.0)), calibration)
    live = Corrector(setup)
    expected = [live.step(Sample(*map(float, column))) for column in columns.T]
    stamps = np.arange(columns.shape[1], dtype=np.int64)
    track = batch.correct(SampleTrack(stamps, columns), setup)
    np.testing.assert_array_equal(track.columns, np.array(expected).T)


def test_bias_and_scale_polynomial_are_removed_inside_their_range_and_clamped_beyond() -> None:
    calibration = Calibration(
        accel_bias=(0.0, 0.0, -0.5), accel_scale_z=(0.1, 0.01), accel_valid_z=(-2.0, 4.0)
    )
    corrector = Corrector(Setup(calibration=calibration))
    assert corrector.step(upright(accel_z=2.5)).accel_z == pytest.approx(3.0 - (0.3 + 0.09))
    clamped = 0.1 * 4.0 + 0.01 * 16.0
    assert corrector.step(upright(accel_z=7.5)).accel_z == pytest.approx(8.0 - clamped)


def test_mounting_turns_all_three_axes_into_the_body() -> None:
    """A board mounted upside down about x, then turned by 90 degrees to the left."""
    robot = Robot(mounting=(math.pi, 0.0, math.pi / 2))
    raw = Sample(0.002, 0.1, 0.2, 0.3, 1.0, 2.0, -3.0)
    corrected = Corrector(Setup(robot)).step(raw)
    assert (corrected.gyro_x, corrected.gyro_y, corrected.gyro_z) == pytest.approx((0.2, 0.1, -0.3))
    assert (corrected.accel_x, corrected.accel_y, corrected.accel_z) == pytest.approx(
        (2.0, 1.0, 3.0)
    )


def test_saturation_travels_as_inflated_variance_of_the_axis_it_hit() -> None:
    robot = Robot()
    corrector = Corrector(Setup(robot))
    fine = corrector.step(upright())
    gyro = corrector.step(upright(gyro_y=-robot.gyro_range))
    accel = corrector.step(upright(accel_x=robot.accel_range))
    assert gyro.gyro_variance_y > 1e4 * fine.gyro_variance_y
    assert gyro.gyro_variance_x == fine.gyro_variance_x
    assert accel.accel_variance_x > 1e3 * fine.accel_variance_x
    assert accel.accel_variance_z == fine.accel_variance_z
    assert accel.angle_variance > 100 * fine.angle_variance
    assert flags(fine) == (0.0,) * 6
    assert flags(gyro) == (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    assert flags(accel) == (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


def flags(sample: CorrectedSample) -> tuple[float, ...]:
    return tuple(getattr(sample, name.replace("_", "_saturated_")) for name in READINGS)


@pytest.mark.parametrize(
    ("mounting", "saturated"),
    [
        ((0.0, 0.0, math.pi / 2), "x"),  # the sensor's y axis points to the robot's back
        ((0.0, 0.0, 0.1), "y"),
        ((0.0, 0.0, math.pi / 4), "xy"),
        ((math.pi / 2, 0.0, 0.0), "z"),
    ],
)
def test_saturation_flags_the_body_axes_that_lack_a_reading(
    mounting: tuple[float, float, float], saturated: str
) -> None:
    robot = Robot(mounting=mounting, gyro_range=math.radians(2000.0))
    sample = Corrector(Setup(robot)).step(upright(gyro_y=-robot.gyro_range))
    for axis in "xyz":
        assert getattr(sample, f"gyro_saturated_{axis}") == float(axis in saturated)
        marked = getattr(sample, f"gyro_variance_{axis}") > GYRO_MARK
        assert marked == (axis in saturated)


def test_first_sample_has_no_motion_terms() -> None:
    first = Corrector(Setup()).step(upright(gyro_y=4.0, accel_x=-3.0, dt=0.0))
    assert first.angle == pytest.approx(math.atan2(3.0, STANDARD_GRAVITY))


def test_free_fall_keeps_the_last_angle_with_a_large_variance() -> None:
    settings = CorrectionSettings(euler=False, centrifugal=False, wheel=False)
    corrector = Corrector(Setup(correction=settings))
    before = corrector.step(upright(accel_x=-3.0))
    falling = corrector.step(upright(accel_z=0.0))
    assert falling.angle == before.angle
    assert falling.angle_variance > 1.0


def test_lost_wheel_degrades_to_the_other_terms_and_returns_without_a_jump() -> None:
    robot = Robot()
    samples = moving_robot(robot)
    gone = samples.columns.copy()
    lost = (TIME > 1.5) & (TIME < 2.5)
    gone[7:10, lost] = 0.0
    angle = batch.correct(SampleTrack(samples.stamps, gone), Setup(robot, correction=QUICK))
    error = np.abs(np.degrees(angle.field("angle") - TILT))
    assert error[(TIME > 2.52) & (TIME < 3.99)].max() < 0.5
    without = Setup(robot, correction=replace(QUICK, wheel=False))
    degraded = batch.correct(samples, without).field("angle")
    np.testing.assert_allclose(
        angle.field("angle")[lost][5:], degraded[lost][5:], atol=math.radians(0.5)
    )


def test_a_counter_that_wraps_leaves_no_more_than_its_samples_without_the_wheel() -> None:
    robot = Robot()
    samples = moving_robot(robot)
    setup, wrapped = Setup(robot, correction=QUICK), samples.columns.copy()
    wheel = Sample._fields.index("wheel_angle")
    wrapped[wheel] = np.mod(wrapped[wheel], 2.0 * math.pi)
    jumps = int(np.sum(np.abs(np.diff(wrapped[wheel])) > math.pi))
    assert jumps > 0
    found = batch.correct(SampleTrack(samples.stamps, wrapped), setup).field("angle")
    changed = np.abs(found - batch.correct(samples, setup).field("angle"))
    assert np.sum(changed > 0.01) <= 3 * jumps
    assert np.degrees(changed.max()) < 10.0


@pytest.mark.parametrize("time_constant", [-0.00065, 0.0, 0.5])
def test_any_stable_time_constant_is_accepted(time_constant: float) -> None:
    settings = CorrectionSettings(velocity_time_constant=time_constant)
    corrector = Corrector(Setup(correction=settings))
    for count in range(200):
        sample = corrector.step(upright(dt=0.02, wheel_angle=0.1 * (count > 0), wheel_count=1.0))
    assert isinstance(sample, CorrectedSample)
    assert sample.angle == pytest.approx(0.0, abs=1e-6)


def turned(lever: tuple[float, float, float], **limits: float) -> tuple[Recording, Setup]:
    """Return a spin at 10 rad/s seen by a perfect IMU off the axle, and its robot."""
    robot = replace(EDUMIP_ROBOT, lever_arm=lever)
    spun = spin(10.0, SpinSensor(0.0, gyro_noise=1e-8, accel_noise=1e-6), 8.0, 1, robot)
    smooth = CorrectionSettings(rate_time_constant=0.0, velocity_time_constant=0.0)
    return spun.recording, Setup(replace(robot, **limits), correction=smooth)


def turned_error(recording: Recording, setup: Setup, **terms: bool) -> np.ndarray:
    chosen = replace(setup, correction=replace(setup.correction, **terms))
    found = batch.correct(pair(recording.imu, recording.wheels), chosen).field("angle")
    assert recording.reference is not None
    return (found - recording.reference.tilt)[1000:]


@pytest.mark.parametrize("lever", [(0.0157, 0.0, 0.046), (-0.02, 0.03, 0.08)])
def test_a_turn_leaves_no_trace_in_the_angle(lever: tuple[float, float, float]) -> None:
    recording, setup = turned(lever)
    without = turned_error(recording, setup, yaw=False, wheel=False)
    within = turned_error(recording, setup, wheel=False)
    assert abs(without.mean()) > 0.1
    assert abs(within.mean()) < 0.005  # what is left are the wheels' accelerations, which average


@pytest.mark.parametrize("turning", [0.0, 1e-4])
def test_a_chip_that_sends_zeros_only_has_all_its_axes_flagged(turning: float) -> None:
    """A gyro that reads anything is not flagged, nor is one that reads zero beside gravity."""
    calibration = Calibration(gyro_bias=(0.02, 0.0, 0.0), accel_bias=(0.3, 0.0, -0.2))
    corrector = Corrector(Setup(Robot(), calibration))
    corrector.step(Sample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY))
    sample = corrector.step(Sample(0.005, 0.0, 0.0, turning, 0.0, 0.0, 0.0))
    assert flags(sample) == (float(turning == 0.0),) * 3 + (1.0,) * 3
    assert (
        flags(corrector.step(Sample(0.005, 0.0, 0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)))
        == (0.0,) * 6
    )


def test_a_dead_accelerometer_is_flagged_and_the_gyro_carries_its_angle() -> None:
    calibration = Calibration(accel_bias=(0.3, 0.0, -0.2))
    corrector = Corrector(Setup(Robot(), calibration))
    before = corrector.step(upright(dt=0.0))
    for _ in range(3):
        dead = corrector.step(upright(dt=0.005, gyro_y=2.0, accel_z=0.0, wheel_count=1.0))
    assert flags(dead) == (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    assert dead.angle == pytest.approx(before.angle + 3 * 0.005 * 2.0)
    assert dead.angle_variance > 1.0


def test_a_silent_chip_says_nothing_whatever_its_calibration() -> None:
    calibration = Calibration(gyro_bias=(0.02, -0.05, 0.0), accel_bias=(0.3, 0.0, -0.2))
    corrector = Corrector(Setup(Robot(), calibration))
    corrector.step(upright(dt=0.0))
    silent = corrector.step(Sample(0.005, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert [getattr(silent, name) for name in READINGS] == [0.0] * 6


@pytest.mark.parametrize("start", [1.5, 2.4])
def test_a_silence_looks_like_no_angular_acceleration(start: float) -> None:
    """A rate that falls to zero and comes back has turned the angle by up to 195 deg."""
    samples, time = moving_robot(Robot()), TIME[::50]
    columns = samples.columns[:, ::50].copy()
    columns[0, 1:] = 50.0 * DT
    columns[1:7, (time > start - 1e-9) & (time < start + 0.03 - 1e-9)] = 0.0
    found = batch.correct(SampleTrack(samples.stamps[::50], columns), Setup()).field("angle")
    near = (time > start - 0.2) & (time < start + 0.2)
    assert np.abs(np.degrees(found - TILT[::50])[near]).max() < 8.0


def test_a_saturated_yaw_gyro_is_replaced_by_the_wheels() -> None:
    recording, setup = turned((0.0157, 0.0, 0.046), gyro_range=math.radians(250.0))
    limit = setup.robot.gyro_range
    imu = replace(recording.imu, gyro=np.clip(recording.imu.gyro, -limit, limit))
    clipped = replace(recording, imu=imu)
    assert abs(turned_error(clipped, setup, wheel=False).mean()) < 0.005
    blind = replace(setup, robot=replace(setup.robot, track_width=0.0))
    assert abs(turned_error(clipped, blind, wheel=False).mean()) > 0.05


def test_with_one_encoder_turning_changes_nothing() -> None:
    recording, setup = turned((0.0157, 0.0, 0.046))
    assert recording.wheels is not None
    one = replace(recording.wheels, angle=recording.wheels.angle.mean(axis=1, keepdims=True))
    single = replace(recording, wheels=one)
    np.testing.assert_array_equal(
        turned_error(single, setup), turned_error(single, setup, yaw=False)
    )


def test_the_terms_of_turning_are_those_of_a_rigid_body() -> None:
    random = np.random.default_rng(5)
    for roll, pitch, yaw, roll_turn, pitch_turn, yaw_turn, x, y, z in random.normal(size=(20, 9)):
        arm, rate = np.array([x, y, z]), np.array([roll, pitch, yaw])
        turn = np.array([roll_turn, pitch_turn, yaw_turn])
        felt = np.cross(turn, arm) + np.cross(rate, np.cross(rate, arm))
        setup = Setup(Robot(lever_arm=(x, y, z)))
        forward, up = correction.turning_acceleration(
            roll, pitch, yaw, roll_turn, yaw_turn, derive(setup)
        )
        forward += pitch_turn * z - pitch * pitch * x  # (14), (15)
        up -= pitch * pitch * z + pitch_turn * x
        np.testing.assert_allclose([forward, up], felt[[0, 2]], atol=1e-12)
