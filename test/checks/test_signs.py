"""The gyro's sign where there are no wheels to decide it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.check import check
from twbr_estimation.checks.finding import Finding, Severity
from twbr_estimation.recording import ImuTrack, Recording
from twbr_estimation.robot import Setup
from twbr_estimation.samples import STANDARD_GRAVITY

DT, SECONDS, SPEED = 0.005, 20.0, 2.0 * math.pi * 1.2
PENDULUM = 0.3
"""Length of the point mass that swings like the body [m]."""


def recorded(amplitude: float, accelerating: bool) -> Recording:
    """Return what the IMU on the axle of a robot reads that swings at 1.2 Hz.

    It balances, which takes an acceleration of g tilt - length * angular acceleration, or its
    axle is held.
    """
    noise = np.random.default_rng(21)
    phase = SPEED * np.arange(0.0, SECONDS, DT)
    tilt, rate = amplitude * np.sin(phase), amplitude * SPEED * np.cos(phase)
    push = (STANDARD_GRAVITY + PENDULUM * SPEED**2) * tilt if accelerating else 0.0 * tilt
    gyro, accel = 0.002 * noise.standard_normal((2, tilt.size, 3)) * [[[1.0]], [[25.0]]]
    gyro[:, 1] += rate
    accel[:, 0] += push * np.cos(tilt) - STANDARD_GRAVITY * np.sin(tilt)
    accel[:, 2] += push * np.sin(tilt) + STANDARD_GRAVITY * np.cos(tilt)
    stamps = np.arange(tilt.size, dtype=np.int64) * round(DT * 1e9)
    return Recording("swing", ImuTrack(stamps, gyro, accel), None, None)


def of_sign(recording: Recording) -> list[Finding]:
    found = check(recording, Setup())
    return [each for each in found if (each.subject, each.check) == ("gyro", "sign")]


@pytest.mark.parametrize("amplitude", [0.1, 0.2])
def test_a_robot_that_wobbles_as_it_balances_is_not_told_of_a_wrong_sign(amplitude: float) -> None:
    (finding,) = of_sign(recorded(amplitude, accelerating=True))
    assert finding.severity is Severity.SKIP and "lean the robot by 10 deg" in finding.sentence


@pytest.mark.parametrize("amplitude", [0.15, 0.3])
def test_a_wrong_sign_is_found_where_the_robot_is_swung_by_hand(amplitude: float) -> None:
    recording = recorded(amplitude, accelerating=False)
    assert of_sign(recording) == []
    wrong = replace(recording, imu=replace(recording.imu, gyro=-recording.imu.gyro))
    (finding,) = of_sign(wrong)
    assert finding.severity is Severity.FAIL and finding.parameter == "robot.mounting"
