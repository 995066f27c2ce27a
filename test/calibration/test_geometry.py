"""Geometry and delays from drives, against the robot the rig hides."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from twbr_estimation.calibration.findings import geometry_findings
from twbr_estimation.calibration.geometry import calibrate_geometry
from twbr_estimation.calibration.regression import regress
from twbr_estimation.calibration.still import StillOptions, calibrate_still
from twbr_estimation.drives import Drive
from twbr_estimation.errors import CalibrationError, RecordingError
from twbr_estimation.imports import ImportOptions, load
from twbr_estimation.recording import ImuTrack, TiltTrack, WheelTrack
from twbr_estimation.robot import EncoderPlacement, Robot, Setup
from twbr_estimation.simulation import simulate

WHEEL_DELAY, REFERENCE_DELAY = 0.006, -0.004
DT = 0.004


@cache
def driven(world: str, seed: int):
    """Return what a drive shows of a robot known from a rest only, and the robot."""
    still = simulate(world, 0.01, 30.0, seed, "still")
    biases = calibrate_still(still.recording, Setup(), StillOptions()).calibration
    drive = simulate(world, DT, 60.0, seed)
    late = replace(
        drive.recording,
        wheels=shifted(drive.recording.wheels, -WHEEL_DELAY),
        reference=shifted(drive.recording.reference, -REFERENCE_DELAY),
    )
    return calibrate_geometry([late], Setup(calibration=biases)), drive.true_setup


def shifted(track: WheelTrack | TiltTrack, seconds: float):
    return replace(track, stamps=track.stamps + round(seconds * 1e9))


@pytest.mark.parametrize(("world", "seed"), [("paper", 41), ("W2", 42), ("W2", 43)])
def test_hidden_geometry_and_delays_are_found(world, seed):
    found, true = driven(world, seed)
    values = {name: estimate.value for name, estimate in found.estimates.items()}
    assert values["wheel radius"] == pytest.approx(true.robot.wheel_radius, rel=0.01)
    assert values["lever arm x"] == pytest.approx(0.0, abs=0.003)
    assert values["lever arm z"] == pytest.approx(true.robot.lever_arm[2], abs=0.003)
    assert values["wheel delay"] == pytest.approx(WHEEL_DELAY, abs=0.001)
    assert values["reference delay"] == pytest.approx(REFERENCE_DELAY, abs=0.001)
    assert values["gyro scale y"] == pytest.approx(true.calibration.gyro_scale[1], rel=0.002)
    assert found.placement is EncoderPlacement.BODY
    robot, calibration = found.setup.robot, found.setup.calibration
    assert robot.wheel_radius == values["wheel radius"]
    assert robot.lever_arm == (values["lever arm x"], 0.0, values["lever arm z"])
    assert calibration.gyro_scale == (1.0, values["gyro scale y"], 1.0)


def test_an_encoder_referred_to_ground_is_recognised():
    drive = simulate("paper", DT, 40.0, 44)
    recording, truth = drive.recording, drive.recording.truth
    turned = recording.wheels.angle + truth.tilt[:, None]
    ground = replace(recording, wheels=WheelTrack(recording.wheels.stamps, turned))
    found = calibrate_geometry([ground], drive.setup)
    assert found.placement is EncoderPlacement.GROUND
    assert found.setup.robot.encoder_placement is EncoderPlacement.GROUND
    assert found.estimates["lever arm z"].value == pytest.approx(0.135, abs=0.003)


def test_what_a_recording_does_not_determine_stays_as_it_was():
    poses = simulate("paper", 0.01, 30.0, 3, "poses").recording
    robot = Robot(wheel_radius=0.05, lever_arm=(0.01, 0.02, 0.03), mounting=(0.1, 0.2, 0.3))
    found = calibrate_geometry([poses], Setup(robot=robot))
    for name in ("wheel radius", "wheel delay"):
        assert found.estimates[name].value is None and found.estimates[name].reason
    assert found.setup.robot.wheel_radius == 0.05
    assert found.setup.robot.lever_arm[1] == 0.02 and found.setup.robot.mounting[::2] == (0.1, 0.3)
    without = calibrate_geometry([replace(poses, wheels=None)], Setup(robot=robot))
    assert without.setup.robot == robot
    assert "no wheel encoder" in without.estimates["lever arm z"].reason
    assert without.estimates["gyro scale y"].value is not None


def test_recordings_that_cannot_serve_are_refused():
    drive = simulate("paper", 0.01, 12.0, 3).recording
    with pytest.raises(RecordingError, match="needs a reference encoder"):
        calibrate_geometry([replace(drive, reference=None)], Setup())
    short = simulate("paper", 0.01, 5.0, 3).recording
    with pytest.raises(RecordingError, match=r"4\.99 s are too short"):
        calibrate_geometry([short], Setup())


def test_real_gyro_and_encoder_on_one_shaft(shared_data):
    folder = shared_data / "uiuc_mpu6050_encoder"
    log = load(folder / "raw_pitch_medium.mat", "uiuc", ImportOptions())
    imu, reference = log.recording.imu, log.recording.reference
    kept = imu.stamps < imu.stamps[0] + 120_000_000_000
    imu = ImuTrack(imu.stamps[kept], imu.gyro[kept], imu.accel[kept])
    setup = Setup(replace(log.robot, gyro_delay=0.0), log.calibration)
    drive = replace(log.recording, imu=imu)
    found = calibrate_geometry([drive], setup).estimates
    # An independent way: the shift at which the encoder follows the integrated gyro best.
    time, encoder = imu.stamps * 1e-9, (reference.stamps * 1e-9, reference.tilt)
    rate = found["gyro scale y"].value * (imu.gyro[:, 1] - log.calibration.gyro_bias[1])
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    shifts = np.arange(-0.010, 0.0101, 0.0005)
    misfits = []
    for shift in shifts:
        error = turned - np.interp(time - shift, *encoder)
        wander = np.polynomial.Polynomial.fit(time, error, 9)(time)
        misfits.append(np.sum((error - wander) ** 2))
    best = shifts[np.argmin(misfits)]
    assert found["reference delay"].value == pytest.approx(best, abs=0.001)
    assert found["gyro scale y"].value == pytest.approx(1.0, abs=0.02)


def test_a_regression_survives_outliers_and_states_its_error():
    scores = []
    for seed in range(40):
        generator = np.random.default_rng(seed)
        blocks = np.repeat(np.arange(60), 20)
        design = np.column_stack([generator.standard_normal(1200), 1e4 * np.ones(1200)])
        shared = np.repeat(generator.standard_normal(60), 20)
        target = design @ [2.0, 3e-4] + shared + 0.3 * generator.standard_normal(1200)
        target[generator.choice(1200, 60, replace=False)] += 50.0
        fit = regress(design, target, blocks)
        scores.append((fit.values - [2.0, 3e-4]) / fit.errors)
    spread = np.sqrt(np.mean(np.square(scores), axis=0))
    assert np.all(spread < 1.5) and np.all(spread > 0.6)
    assert math.isclose(float(np.mean(scores)), 0.0, abs_tol=0.5)


@pytest.mark.parametrize("factor", [-1.0, 57.3])
def test_a_gyro_of_another_sign_or_unit_is_no_scale_error(factor) -> None:
    drive = simulate("paper", 0.01, 15.0, 5)
    imu = replace(drive.recording.imu, gyro=factor * drive.recording.imu.gyro)
    wide = replace(drive.setup.robot, gyro_range=200.0)
    setup = Setup(wide, replace(drive.setup.calibration, gyro_bias=(0.0, 0.0, 0.0)))
    with pytest.raises(CalibrationError, match="no scale error"):
        calibrate_geometry([replace(drive.recording, imu=imu)], setup)


def test_a_gyro_and_a_reference_with_nothing_in_common_are_named() -> None:
    drive = simulate("W4", 0.005, 30.0, 1)
    imu, reference = drive.recording.imu, drive.recording.reference
    assert reference is not None
    degrees = replace(drive.recording, imu=replace(imu, gyro=np.degrees(imu.gyro)))
    with pytest.raises(CalibrationError, match="it looks like deg/s"):
        calibrate_geometry([degrees], drive.setup)
    still = TiltTrack(reference.stamps, 0.0 * reference.tilt)
    with pytest.raises(CalibrationError, match="reference: its angle never changes"):
        calibrate_geometry([replace(drive.recording, reference=still)], drive.setup)


def test_a_smoothed_reference_gives_lengths_but_not_the_gyro_s_scale() -> None:
    simulated = simulate("W2", 0.004, 60.0, 1)
    bare = replace(simulated.recording, reference=None, truth=None)
    drive = Drive(bare, simulated.setup)
    with_reference = drive.with_reference(drive.smoothed().as_track()).recording
    found = calibrate_geometry([with_reference], simulated.setup, smoothed=True)
    assert found.estimates["gyro scale y"].value is None
    assert found.setup.calibration.gyro_scale == simulated.setup.calibration.gyro_scale
    true = simulated.true_setup.robot
    for name, value in (("wheel radius", true.wheel_radius), ("lever arm z", true.lever_arm[2])):
        each = found.estimates[name]
        assert each.value is not None and each.error is not None
        assert each.value == pytest.approx(value, abs=3.0 * each.error)


@pytest.mark.parametrize(
    ("factor", "message"), [(-1.0, "run backward"), (210.0, "times the true angle")]
)
def test_wheels_that_contradict_the_imu_are_named_and_refused(factor: float, message: str) -> None:
    drive = simulate("W1", 0.005, 30.0, 31)
    track = drive.recording.wheels
    assert track is not None
    wrong = replace(drive.recording, wheels=replace(track, angle=track.angle * factor))
    with pytest.raises(CalibrationError, match=message):
        calibrate_geometry([wrong], drive.setup)


def test_a_smoothed_reference_blames_what_is_wrong() -> None:
    drive = simulate("W4", 0.005, 30.0, 1)
    track = drive.recording.wheels
    assert track is not None
    bare = replace(drive.recording, reference=None, truth=None)
    mirrored = Drive(
        replace(bare, wheels=replace(track, angle=track.angle * [1.0, -1.0])), drive.setup
    )
    smoothed = mirrored.with_reference(mirrored.smoothed().as_track()).recording
    with pytest.raises(CalibrationError, match="right wheel runs backward") as raised:
        calibrate_geometry([smoothed], drive.setup, smoothed=True)
    assert "no scale error" not in str(raised.value) and "reference" not in str(raised.value)


def test_wheels_that_stand_still_give_no_lever_arm() -> None:
    drive = simulate("W1", 0.005, 30.0, 31)
    track = drive.recording.wheels
    assert track is not None
    dead = replace(drive.recording, wheels=replace(track, angle=0.0 * track.angle))
    with pytest.raises(CalibrationError, match=r"angle never changes .*`topics.joint_states`"):
        calibrate_geometry([dead], drive.setup)
    without = calibrate_geometry([replace(dead, wheels=None)], drive.setup)
    assert without.estimates["lever arm z"].value is None


def test_a_radius_that_is_replaced_is_named() -> None:
    drive = simulate("W1", 0.005, 30.0, 31)
    track = drive.recording.wheels
    assert track is not None
    doubled = replace(drive.recording, wheels=replace(track, angle=2.0 * track.angle))
    found = calibrate_geometry([doubled], drive.setup)
    assert found.estimates["wheel radius"].value == pytest.approx(
        0.5 * drive.true_setup.robot.wheel_radius, rel=0.1
    )
    (note,) = geometry_findings(found, drive.setup).notes[:1]
    assert "as configured" in note and "times the true angle" in note
