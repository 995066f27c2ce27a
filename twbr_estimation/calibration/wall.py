"""Pitch of the IMU's mounting from a robot that leans against a wall, forward and backward.

Turned round by half a turn, the robot leans as far backward as it leant forward. The mean of
both tilts is what the mounting, and the bias of the forward axis, add.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..checks.evidence import calibrated
from ..checks.units import of_accelerometer
from ..errors import CalibrationError
from ..recording import Recording
from ..robot import Setup
from ..samples import STANDARD_GRAVITY
from .findings import ANGLE, CalibrationFinding, Findings
from .held import held

LEAST_LEAN = math.radians(3.0)
"""Smallest lean to either side [rad]."""
LARGEST_LEAN = math.radians(75.0)
"""A robot that leans further lies [rad]."""
GRAVITY = (0.6, 1.4)
"""Length of the force at rest over gravity's; 0.4 is what the worst boards are off."""
SYMMETRY = math.radians(0.2)
"""Standard uncertainty of leaning as far forward as backward [rad]."""
LARGEST = math.radians(20.0)
"""A larger pitch is no error of mounting [rad]."""


def calibrate_wall(recordings: Sequence[Recording], setup: Setup) -> Findings:
    """Estimate the pitch of the mounting.

    Args:
        recordings: together they hold both leans, each for a second or more.
        setup: calibrated accelerometer.

    Raises:
        CalibrationError: a side is missing, or the result is no error of mounting.
    """
    tilts = [tilt for recording in recordings for tilt in _tilts(recording, setup)]
    middle = 0.5 * (max(tilts, default=0.0) + min(tilts, default=0.0))
    forward = [tilt for tilt in tilts if tilt > middle]
    backward = [tilt for tilt in tilts if tilt < middle]
    lean = 0.5 * (np.mean(forward) - np.mean(backward)) if forward and backward else 0.0
    if lean < LEAST_LEAN:
        raise CalibrationError(
            f"wall: the robot leans {math.degrees(float(lean)):.2g} deg to either side, at least "
            f"{math.degrees(LEAST_LEAN):g} deg are needed, forward and backward, a second each"
        )
    if lean > LARGEST_LEAN:
        raise CalibrationError(
            f"wall: the robot leans {math.degrees(float(lean)):.3g} deg to either side, at most "
            f"{math.degrees(LARGEST_LEAN):g} deg are a lean; check the accelerometer's axes and "
            "signs, and robot.mounting"
        )
    pitch = 0.5 * float(np.mean(forward) + np.mean(backward))
    if abs(pitch) > LARGEST:
        raise CalibrationError(
            f"wall: a pitch of {math.degrees(pitch):.3g} deg is no error of mounting; check "
            "robot.mounting and the accelerometer's axes"
        )
    roll, before, yaw = setup.robot.mounting
    robot = replace(setup.robot, mounting=(roll, before + pitch, yaw))
    note = f"leans {math.degrees(float(lean)):.3g} deg to either side"
    found = CalibrationFinding("mounting pitch", ANGLE, before, before + pitch, SYMMETRY, note)
    return Findings(replace(setup, robot=robot), (found,))


def _tilts(recording: Recording, setup: Setup) -> list[float]:
    _, force = calibrated(recording.imu, setup)
    means = [force[each.begin : each.end].mean(axis=0) for each in held([recording])]
    for mean in means:
        _require_gravity(recording.source, float(np.linalg.norm(mean)))
    return [math.atan2(-float(mean[0]), float(mean[2])) for mean in means]


def _require_gravity(source: str, length: float) -> None:
    ratio = length / STANDARD_GRAVITY
    if GRAVITY[0] < ratio < GRAVITY[1]:
        return
    unit = of_accelerometer(ratio)
    raise CalibrationError(
        f"{source}: accelerometer: held still it reads {length:.3g} where gravity is "
        f"{STANDARD_GRAVITY:.3g} m/s^2: "
        + (f"it is in {unit}; give m/s^2" if unit else "check its unit and calibration.accel_bias")
    )
