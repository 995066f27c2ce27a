"""What the navigation had learnt of its sensors before its wheels came into doubt."""

from typing import NamedTuple

from .navigation import Navigation
from .parameters import Coefficients
from .strapdown import Vector

WRONG_GAIN, WRONG_RADIUS = 3.0, 5.0
"""A gain of tilt's or yaw's gyro, or a wheel radius, that is learnt to be off by so many of its
standard deviations is an error of the wheels that the navigation has taken for one of the sensor. A
gain of roll's gyro is a drift of its bias."""
MEMORY_PERIOD = 3.0
"""Time between two memories of what was learnt of the sensors [s]."""


class Learnt(NamedTuple):
    """What the navigation had learnt of its sensors at some time; see `Navigation`."""

    gyro_bias: Vector
    gyro_gain: Vector
    accel_bias: Vector
    lever_up: float
    wheel_radius: float
    gyro_cross: float
    bend: tuple[float, float]
    lever_left: float


class LearntBefore(NamedTuple):
    """What it had learnt before the present doubts about its wheels could have begun."""

    older: Learnt
    newer: Learnt
    age: float
    """Of the newer one [s]."""


def strangeness(nav: Navigation, c: Coefficients) -> float:
    """Return how implausible what was learnt is; 1 is not possible with right wheels.

    Args:
        nav: what was learnt.
        c: standard deviations before anything was learnt.
    """
    gain, found = max(abs(nav.gyro_gain[1]), abs(nav.gyro_gain[2])), 0.0
    if c.gyro_gain > 0.0:
        found = gain / (WRONG_GAIN * c.gyro_gain)
    if c.wheel_radius > 0.0:
        found = max(found, abs(nav.wheel_radius) / (WRONG_RADIUS * c.wheel_radius))
    return found


def learnt_by(nav: Navigation) -> Learnt:
    """Return what a navigation has learnt."""
    return Learnt(
        gyro_bias=nav.gyro_bias,
        gyro_gain=nav.gyro_gain,
        accel_bias=nav.accel_bias,
        lever_up=nav.lever_up,
        wheel_radius=nav.wheel_radius,
        gyro_cross=nav.gyro_cross,
        bend=nav.bend,
        lever_left=nav.lever_left,
    )


def begin_memory(nav: Navigation) -> LearntBefore:
    """Begin with what is known at the start."""
    return LearntBefore(learnt_by(nav), learnt_by(nav), 0.0)


def remembered(memory: LearntBefore, nav: Navigation, sound: bool, time: float) -> LearntBefore:
    """Return the memory some time later; it stands still while wheels are in doubt."""
    if not sound:
        return LearntBefore(memory.older, memory.newer, 0.0)
    if memory.age + time < MEMORY_PERIOD:
        return LearntBefore(memory.older, memory.newer, memory.age + time)
    return LearntBefore(memory.newer, learnt_by(nav), 0.0)


def bias_drift(memory: LearntBefore) -> Vector:
    """Return how fast the gyro's bias changed between two memories [rad/s^2]."""
    (a, b, c), (x, y, z) = memory.older.gyro_bias, memory.newer.gyro_bias
    return (x - a) / MEMORY_PERIOD, (y - b) / MEMORY_PERIOD, (z - c) / MEMORY_PERIOD


def recalled(nav: Navigation, learnt: Learnt) -> Navigation:
    """Return a navigation with the errors of its sensors that were learnt before."""
    return Navigation(
        attitude=nav.attitude,
        velocity=nav.velocity,
        position=nav.position,
        distance=nav.distance,
        gyro_bias=learnt.gyro_bias,
        gyro_gain=learnt.gyro_gain,
        accel_bias=learnt.accel_bias,
        excess=nav.excess,
        exceeded=nav.exceeded,
        lever_up=learnt.lever_up,
        wheel_radius=learnt.wheel_radius,
        gyro_cross=learnt.gyro_cross,
        bend=learnt.bend,
        lever_left=learnt.lever_left,
    )
