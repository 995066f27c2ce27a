"""Doubts about recordings whose numbers can be used, but not trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.check import check
from twbr_estimation.checks.timing import timing
from twbr_estimation.drives import Drive
from twbr_estimation.recording import ImuTrack, Recording, TiltTrack, WheelTrack
from twbr_estimation.robot import Calibration, CorrectionSettings, Robot, Setup
from twbr_estimation.scoring.score import score_recording

STAMPS = np.arange(0, 20_000_000_000, 5_000_000)
TIME = STAMPS * 1e-9
BIAS = 0.02


def tilt(time: np.ndarray) -> np.ndarray:
    return 0.2 * np.sin(5.0 * time) + 0.1 * np.sin(2.0 * time)


def tilt_rate(time: np.ndarray) -> np.ndarray:
    return np.cos(5.0 * time) + 0.2 * np.cos(2.0 * time)


def swing() -> Recording:
    """Return a swing about a standing axle, the IMU in the axle; the gyro has a bias."""
    angle = tilt(TIME)
    gyro = np.zeros((TIME.size, 3))
    gyro[:, 1] = tilt_rate(TIME) + BIAS
    accel = 9.80665 * np.column_stack([-np.sin(angle), np.zeros(TIME.size), np.cos(angle)])
    wheels = WheelTrack(STAMPS, -angle[:, None])
    return Recording("swing", ImuTrack(STAMPS, gyro, accel), wheels, TiltTrack(STAMPS, angle))


ROBOT = Robot(lever_arm=(0.0, 0.0, 0.0))
SETUP = Setup(ROBOT, Calibration(gyro_bias=(0.0, BIAS, 0.0)))


def doubts_of(recording: Recording, setup: Setup) -> tuple[str, ...]:
    return Drive(recording, setup).doubts


def the_doubt(recording: Recording, setup: Setup = SETUP) -> str:
    (text,) = doubts_of(recording, setup)
    return text


def with_imu(gyro: float = 1.0, accel: float = 1.0) -> Recording:
    imu = swing().imu
    return replace(swing(), imu=replace(imu, gyro=imu.gyro * gyro, accel=imu.accel * accel))


def test_nothing_is_said_of_a_good_recording() -> None:
    assert list(doubts_of(swing(), SETUP)) == []


def test_nothing_is_said_of_a_delayed_reference() -> None:
    late = TiltTrack(STAMPS + 30_000_000, tilt(TIME))
    assert list(doubts_of(replace(swing(), reference=late), SETUP)) == []


def test_a_reference_that_rests_while_the_robot_swings_is_noticed() -> None:
    still = TiltTrack(STAMPS, np.zeros(STAMPS.size))
    assert "its angle never changes" in the_doubt(replace(swing(), reference=still))


def test_an_accelerometer_in_g_is_noticed() -> None:
    assert "it is in g" in the_doubt(with_imu(accel=1.0 / 9.80665))


@pytest.mark.parametrize(
    ("factor", "said"), [(-1.0, "with the wrong sign"), (180.0 / np.pi, "it looks like deg/s")]
)
def test_a_gyro_of_the_wrong_sign_or_unit_is_noticed(factor: float, said: str) -> None:
    setup = Setup(ROBOT, Calibration(gyro_bias=(0.0, BIAS * factor, 0.0)))
    gyro, reference = doubts_of(with_imu(gyro=factor), setup)
    assert gyro.startswith("gyro: the pitch rate contradicts") and said in gyro
    assert reference.endswith("the gyro is wrong, see there")


def test_a_reference_in_degrees_and_a_wrong_mounting_are_noticed() -> None:
    degrees = replace(swing(), reference=TiltTrack(STAMPS, np.degrees(tilt(TIME))))
    assert "so the reference has the wrong sign, unit" in the_doubt(degrees)
    turned = replace(SETUP, robot=Robot(mounting=(0.0, 0.0, np.pi)))
    assert any("the gyro turns -1 times" in text for text in doubts_of(swing(), turned))


def test_wheels_that_are_missing_partial_or_slow_are_noticed() -> None:
    none = replace(swing(), wheels=None)
    assert "no wheel encoder" in the_doubt(none)
    half = replace(swing(), wheels=WheelTrack(STAMPS[:2000], -tilt(TIME)[:2000, None]))
    assert "% of the samples have no wheel reading" in the_doubt(half)
    slow = replace(swing(), wheels=WheelTrack(STAMPS[::10], -tilt(TIME)[::10, None]))
    assert "readings come every 50 ms, IMU samples every 5 ms" in the_doubt(slow)
    without_term = replace(SETUP, correction=CorrectionSettings(wheel=False))
    assert list(doubts_of(none, without_term)) == []


@pytest.mark.parametrize("every", [20, 30])
def test_the_cost_of_a_slow_reference_is_reported(every: int) -> None:
    slow = replace(swing(), reference=TiltTrack(STAMPS[::every], tilt(TIME)[::every]))
    told = float(the_doubt(slow).partition("about ")[2].split()[0])
    exact = {"exact": TiltTrack(STAMPS, tilt(TIME))}
    cost = score_recording(slow, exact).estimators["exact"].mse_deg2
    assert told == pytest.approx(cost, rel=0.1)


@pytest.mark.parametrize(("missing", "said"), [(1, "1 gap, "), (2, "2 gaps, ")])
def test_one_gap_is_said_in_the_singular(missing: int, said: str) -> None:
    stamps = np.arange(1000, dtype=np.int64) * 5_000_000
    for hole in range(missing):
        stamps[300 * (hole + 1) :] += 100_000_000
    imu = ImuTrack(stamps, np.zeros((1000, 3)), np.tile([0.0, 0.0, 9.81], (1000, 1)))
    (found,) = [each for each in timing(Recording("gaps", imu)) if each.subject == "IMU"]
    assert said in found.text


def test_one_jump_is_said_in_the_singular() -> None:
    stamps = np.arange(1000, dtype=np.int64) * 5_000_000
    angle = 0.01 * np.arange(1000.0)[:, None]
    angle[500:] += 60.0
    imu = ImuTrack(stamps, np.zeros((1000, 3)), np.tile([0.0, 0.0, 9.81], (1000, 1)))
    recording = Recording("jump", imu, WheelTrack(stamps, angle))
    (found,) = [each for each in check(recording, Setup()) if each.check == "jumps"]
    assert "the angle jumps 1 time, by up to 60" in found.text
