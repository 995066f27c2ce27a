"""Doubts about recordings whose numbers can be used, but not trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.recording import ImuTrack, Recording, TiltTrack, WheelTrack
from twbr_estimation.robot import Calibration, CorrectionSettings, Robot, Setup
from twbr_estimation.scoring.errors import score_recording
from twbr_estimation.scoring.plausibility import doubts

STAMPS = np.arange(0, 20_000_000_000, 5_000_000)
TIME = STAMPS * 1e-9
BIAS = 0.02


def tilt(time: np.ndarray) -> np.ndarray:
    return 0.2 * np.sin(5.0 * time)


def swing() -> Recording:
    """Return a swing about a standing axle; the gyro has a bias."""
    angle = tilt(TIME)
    gyro = np.zeros((TIME.size, 3))
    gyro[:, 1] = np.cos(5.0 * TIME) + BIAS
    accel = 9.80665 * np.column_stack([-np.sin(angle), np.zeros(TIME.size), np.cos(angle)])
    wheels = WheelTrack(STAMPS, -angle[:, None])
    return Recording("swing", ImuTrack(STAMPS, gyro, accel), wheels, TiltTrack(STAMPS, angle))


SETUP = Setup(calibration=Calibration(gyro_bias=(0.0, BIAS, 0.0)))


def the_doubt(recording: Recording, setup: Setup = SETUP) -> str:
    (text,) = doubts(recording, setup)
    return text


def with_imu(gyro: float = 1.0, accel: float = 1.0) -> Recording:
    imu = swing().imu
    return replace(swing(), imu=replace(imu, gyro=imu.gyro * gyro, accel=imu.accel * accel))


def test_nothing_is_said_of_a_good_recording() -> None:
    assert list(doubts(swing(), SETUP)) == []


def test_nothing_is_said_of_a_delayed_or_resting_reference() -> None:
    late = TiltTrack(STAMPS + 30_000_000, tilt(TIME))
    assert list(doubts(replace(swing(), reference=late), SETUP)) == []
    still = TiltTrack(STAMPS, np.zeros(STAMPS.size))
    assert list(doubts(replace(swing(), reference=still), SETUP)) == []


def test_an_accelerometer_in_g_is_noticed() -> None:
    assert "the median reading is 1 m/s^2" in the_doubt(with_imu(accel=1.0 / 9.80665))


@pytest.mark.parametrize(("factor", "gain"), [(-1.0, "-1"), (180.0 / np.pi, "57")])
def test_a_gyro_of_the_wrong_sign_or_unit_is_noticed(factor: float, gain: str) -> None:
    setup = Setup(calibration=Calibration(gyro_bias=(0.0, BIAS * factor, 0.0)))
    assert f"the gyro turns {gain} times" in the_doubt(with_imu(gyro=factor), setup)


def test_a_reference_in_degrees_and_a_wrong_mounting_are_noticed() -> None:
    degrees = replace(swing(), reference=TiltTrack(STAMPS, np.degrees(tilt(TIME))))
    assert "times as far as the reference" in the_doubt(degrees)
    turned = replace(SETUP, robot=Robot(mounting=(0.0, 0.0, np.pi)))
    assert "the gyro turns -1 times" in the_doubt(swing(), turned)


def test_wheels_that_are_missing_partial_or_slow_are_noticed() -> None:
    none = replace(swing(), wheels=None)
    assert "no wheel encoder" in the_doubt(none)
    half = replace(swing(), wheels=WheelTrack(STAMPS[:2000], -tilt(TIME)[:2000, None]))
    assert "% of the samples have no wheel reading" in the_doubt(half)
    slow = replace(swing(), wheels=WheelTrack(STAMPS[::10], -tilt(TIME)[::10, None]))
    assert "wheel readings every 50 ms, IMU samples every 5 ms" in the_doubt(slow)
    without_term = replace(SETUP, correction=CorrectionSettings(wheel=False))
    assert list(doubts(none, without_term)) == []


@pytest.mark.parametrize("every", [20, 30])
def test_the_cost_of_a_slow_reference_is_told_as_it_is(every: int) -> None:
    slow = replace(swing(), reference=TiltTrack(STAMPS[::every], tilt(TIME)[::every]))
    told = float(the_doubt(slow).partition("about ")[2].split()[0])
    exact = {"exact": TiltTrack(STAMPS, tilt(TIME))}
    cost = score_recording(slow, exact).estimators["exact"].mse_deg2
    assert told == pytest.approx(cost, rel=0.1)
