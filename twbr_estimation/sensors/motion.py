"""Motion of simulated sensors as a function of time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from ..robot import Robot
from ..samples import STANDARD_GRAVITY

SWING_AMPLITUDE = math.radians(5.0)
SWING_RATE = 2.0 * math.pi * 0.5
"""Angular frequency of the swing [rad/s]."""
SWING_HEIGHT = Robot().lever_arm[2]
"""Height of the IMU above the axle [m]."""


class ImuMotion(NamedTuple):
    """True angular rate and specific force at the sensor, in its axes."""

    gyro_x: float
    """[rad/s]"""
    gyro_y: float
    gyro_z: float
    accel_x: float
    """[m/s^2], +g on the axis that points up."""
    accel_y: float
    accel_z: float
    temperature: float = 25.0
    """[degC]"""


Motion = Callable[[float], ImuMotion]
"""motion(seconds): input of the IMU."""

Angle = Callable[[float], float]
"""angle(seconds): what an encoder turns [rad]."""


def swing_tilt(seconds: float) -> float:
    """Return the tilt of a robot that swings gently about its axle [rad]."""
    return SWING_AMPLITUDE * math.sin(SWING_RATE * seconds)


def swing_wheel(seconds: float) -> float:
    """Return what its wheel encoders count: the wheels stand, the body turns in them [rad]."""
    return -swing_tilt(seconds)


def swing(seconds: float) -> ImuMotion:
    """Return the input of its IMU, with the accelerations of Laddach 2022 (14) and (15)."""
    tilt = swing_tilt(seconds)
    rate = SWING_AMPLITUDE * SWING_RATE * math.cos(SWING_RATE * seconds)
    euler = -SWING_HEIGHT * SWING_RATE**2 * tilt
    centrifugal = SWING_HEIGHT * rate**2
    return ImuMotion(
        0.0,
        rate,
        0.0,
        euler - STANDARD_GRAVITY * math.sin(tilt),
        0.0,
        STANDARD_GRAVITY * math.cos(tilt) - centrifugal,
    )
