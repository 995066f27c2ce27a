"""Calibration without a reference encoder, against constants that are hidden."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from twbr_estimation.calibration.balance import calibrate_balance
from twbr_estimation.calibration.faces import calibrate_faces
from twbr_estimation.calibration.findings import Findings
from twbr_estimation.calibration.turns import calibrate_turns
from twbr_estimation.calibration.wall import calibrate_wall
from twbr_estimation.errors import CalibrationError
from twbr_estimation.imports import ImportOptions, load
from twbr_estimation.recording import ImuTrack, Recording, WheelTrack
from twbr_estimation.robot import Calibration, Robot, Setup

G = 9.80665
BIAS = np.array([0.3, -0.2, 0.6])
SCALE = np.array([1.01, 0.985, 1.03])
FACES = np.vstack([np.eye(3), -np.eye(3)])
DT = 0.01


def recording(rate: np.ndarray, force: np.ndarray, seed: int) -> Recording:
    """Return what a noisy sensor with a gyro bias reads."""
    generator = np.random.default_rng(seed)
    stamps = np.arange(rate.shape[0]) * round(DT * 1e9)
    gyro = rate + np.array([0.02, -0.01, 0.03]) + generator.normal(0.0, 0.0017, rate.shape)
    return Recording("made", ImuTrack(stamps, gyro, force + generator.normal(0, 0.04, force.shape)))


def on_faces(seed: int, faces: np.ndarray) -> Recording:
    """Return faces of 3 s each, put down up to a degree off square."""
    generator = np.random.default_rng(seed)
    pieces = []
    for face in faces:
        up = face + generator.normal(0.0, math.radians(0.6), 3) * (face == 0.0)
        pieces.append(np.tile(G * up / np.linalg.norm(up) * SCALE + BIAS, (300, 1)))
    force = np.concatenate(pieces)
    return recording(np.zeros_like(force), force, seed)


def value(found: Findings, name: str) -> tuple[float, float]:
    (each,) = [each for each in found.quantities if each.name == name]
    assert each.value is not None and each.error is not None
    return each.value, each.error


@pytest.mark.parametrize("count", [3, 4, 6])
def test_faces_give_biases_and_scales_within_their_errors(count: int) -> None:
    worst = []
    for seed in range(12):
        found = calibrate_faces([on_faces(seed, FACES[:count])], Setup())
        for axis, name in enumerate("xyz"):
            for what, true in (("bias", BIAS[axis]), ("scale", SCALE[axis])):
                got, error = value(found, f"accelerometer {what} {name}")
                worst.append((got - true) / error)
    assert np.sqrt(np.mean(np.square(worst))) < 1.5 and np.abs(worst).max() < 4.0


def test_opposite_faces_are_ten_times_better_and_mend_the_readings() -> None:
    found = calibrate_faces([on_faces(3, FACES)], Setup())
    assert value(found, "accelerometer bias x")[1] < 0.01
    calibration = found.setup.calibration
    corrected = 1.0 - np.array([calibration.accel_scale_x, calibration.accel_scale_z]).ravel()
    reading = np.array([G * SCALE[0] + BIAS[0], G * SCALE[2] + BIAS[2]])
    force = (reading - np.array(calibration.accel_bias)[[0, 2]]) * corrected
    assert force == pytest.approx(G, abs=0.02)


def test_faces_that_determine_nothing_are_refused() -> None:
    with pytest.raises(CalibrationError, match="axis y, z never points up or down"):
        calibrate_faces([on_faces(1, FACES[[0, 3]])], Setup())
    rested = on_faces(1, FACES)
    in_g = replace(rested, imu=replace(rested.imu, accel=rested.imu.accel / G))
    with pytest.raises(CalibrationError, match="none of a sound sensor"):
        calibrate_faces([in_g], Setup())


def turned(seed: int, turns: float, gain: float) -> Recording:
    rate = np.zeros((2200, 3))
    rate[500:1700, 2] = turns * math.tau / 12.0 * gain
    return recording(rate, np.tile([0.0, 0.0, G], (2200, 1)), seed)


@pytest.mark.parametrize("gain", [0.95, 1.0, 1.06])
def test_turns_give_the_gyro_s_scale(gain: float) -> None:
    for seed in range(5):
        scale, error = value(calibrate_turns([turned(seed, -3.0, gain)], Setup()), "gyro scale z")
        assert scale == pytest.approx(1.0 / gain, abs=3.0 * error) and error < 0.006


def test_what_is_no_whole_turn_is_refused() -> None:
    with pytest.raises(CalibrationError, match="whole turns are needed"):
        calibrate_turns([turned(1, 0.3, 1.0)], Setup())
    with pytest.raises(CalibrationError, match="is not plausible"):
        calibrate_turns([turned(1, 2.0, 57.3)], Setup(), turns=2)


@pytest.mark.parametrize("turns", [2.0, 2.01])
def test_degrees_are_no_whole_turns(turns: float) -> None:
    with pytest.raises(CalibrationError, match=r"reads up to .* beyond robot.gyro_range"):
        calibrate_turns([turned(1, turns, math.degrees(1.0))], Setup())


def gyro_about_z(drive: Recording, rate: np.ndarray) -> Recording:
    """Return a recording with a further rate about z [rad/s], (n,)."""
    further = np.column_stack([0.0 * rate, 0.0 * rate, rate])
    return replace(drive, imu=replace(drive.imu, gyro=drive.imu.gyro + further))


def test_a_drive_is_no_turn_by_hand() -> None:
    drive = turned(1, 2.0, 1.0)
    swaying = np.sin(np.arange(2200) * 0.1) * 2.5
    gyro = drive.imu.gyro + np.column_stack([0.0 * swaying, swaying, 0.0 * swaying])
    driven = replace(drive, imu=replace(drive.imu, gyro=gyro))
    with pytest.raises(CalibrationError, match="of the motion is one turn about z"):
        calibrate_turns([driven], Setup())
    to_and_fro = gyro_about_z(drive, 3.0 * swaying)
    with pytest.raises(CalibrationError, match="of the motion is one turn about z"):
        calibrate_turns([to_and_fro], Setup(replace(Robot(), gyro_range=20.0)))


def test_a_bias_in_degrees_is_no_turn() -> None:
    rate = np.tile([0.0, 2.0, 0.0], (2200, 1))
    resting = recording(rate, np.tile([0.0, 0.0, G], (2200, 1)), 1)
    with pytest.raises(CalibrationError, match="shows no half turn: check the gyro's unit"):
        calibrate_turns([resting], Setup())


def leaning(seed: int, pitch: float, *tilts: float) -> Recording:
    """Return leans of 3 s each; a pitched sensor shows each lean larger by its pitch."""
    pieces = [
        np.tile([-G * math.sin(tilt + pitch), 0.0, G * math.cos(tilt + pitch)], (300, 1))
        for tilt in tilts
    ]
    force = np.concatenate(pieces)
    return recording(np.zeros_like(force), force, seed)


def test_a_wall_gives_the_mounting() -> None:
    for seed in range(5):
        found = calibrate_wall([leaning(seed, math.radians(1.5), 0.3, -0.3)], Setup())
        pitch, error = value(found, "mounting pitch")
        assert pitch == pytest.approx(math.radians(1.5), abs=3.0 * error)
        assert found.setup.robot.mounting[1] == pitch
    with pytest.raises(CalibrationError, match="to either side"):
        calibrate_wall([leaning(1, 0.0, 0.2)], Setup())


def balancing(seed: int, balance: float, swing: float) -> Recording:
    """Return 60 s of a robot that drives to and fro about the tilt at which it balances."""
    generator = np.random.default_rng(seed)
    time = np.arange(6000) * DT
    pulse = math.tau * np.array([0.31, 0.53, 0.87])
    phase = generator.uniform(0.0, math.tau, 3)
    waves = np.sin(pulse * time[:, None] + phase)
    tilt = balance + swing * waves.sum(axis=1)
    rate = swing * (pulse * np.cos(pulse * time[:, None] + phase)).sum(axis=1)
    # Away from its balance an inverted pendulum stays up only by g times the tilt forward.
    acceleration = G * (tilt - balance)
    distance = -G * swing * (waves / pulse**2).sum(axis=1)
    force = np.column_stack(
        [
            acceleration * np.cos(tilt) - G * np.sin(tilt),
            np.zeros(time.size),
            acceleration * np.sin(tilt) + G * np.cos(tilt),
        ]
    )
    made = recording(np.column_stack([0.0 * rate, rate, 0.0 * rate]), force, seed)
    radius = Setup().robot.wheel_radius
    track = WheelTrack(made.imu.stamps, (distance / radius - (tilt - balance))[:, None])
    return replace(made, wheels=track)


@pytest.mark.parametrize("balance", [-0.06, 0.0, 0.03])
def test_calm_balancing_gives_the_tilt_at_which_it_balances(balance: float) -> None:
    for seed in range(4):
        made = balancing(seed, balance, 0.01)
        found = calibrate_balance([made], Setup(robot=Robot(lever_arm=(0.0, 0.0, 0.0))))
        tilt, error = value(found, "balance tilt")
        assert tilt == pytest.approx(balance, abs=3.0 * error + 1e-4) and error < math.radians(0.3)


def test_leans_that_are_none_are_refused() -> None:
    both = leaning(1, 0.0, 0.3, -0.3)
    in_g = replace(both, imu=replace(both.imu, accel=both.imu.accel / G))
    with pytest.raises(CalibrationError, match="it is in g; give m/s"):
        calibrate_wall([in_g], Setup())
    upside_down = replace(both, imu=replace(both.imu, accel=both.imu.accel * [-1.0, 1.0, -1.0]))
    with pytest.raises(CalibrationError, match="check the accelerometer's axes"):
        calibrate_wall([upside_down], Setup())


def test_wild_balancing_is_refused() -> None:
    with pytest.raises(CalibrationError, match="is known to"):
        calibrate_balance([balancing(1, 0.0, 0.6)], Setup())


def test_real_faces_and_turns(shared_data: Path) -> None:
    folder = shared_data / "mpu6050_static"
    faces = [
        load(each, "mpu6050-static", ImportOptions()).recording
        for each in sorted(folder.glob("unmoved*"))
        if not each.name.endswith("10min")
    ]
    found = calibrate_faces(faces, Setup())
    for name in "xyz":
        assert value(found, f"accelerometer scale {name}")[0] == pytest.approx(1.0, abs=0.08)
        assert abs(value(found, f"accelerometer bias {name}")[0]) < 0.5
    by_hand = load(folder / "rotate-ccw-around-y-pointing-left", "mpu6050-static", ImportOptions())
    bias = tuple(np.radians([4.535, 0.047, 1.122]).tolist())
    turns = calibrate_turns([by_hand.recording], Setup(calibration=Calibration(gyro_bias=bias)))
    assert value(turns, "gyro scale y")[0] == pytest.approx(1.0, abs=0.02)
