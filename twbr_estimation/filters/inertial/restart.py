"""Where and how the navigation begins, and begins again from the vertical."""

from typing import NamedTuple

import numpy as np

from ...samples import STANDARD_GRAVITY
from .beginning import Beginning
from .error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    BEND,
    GYRO_BIAS,
    GYRO_CROSS,
    GYRO_GAIN,
    LEVER_LEFT,
    LEVER_UP,
    POSITION,
    STATES,
    VELOCITY,
    WHEEL_RADIUS,
    Array,
    forget,
)
from .learnt import LearntBefore, bias_drift, learnt_by, recalled
from .navigation import Navigation
from .parameters import Coefficients
from .strapdown import Quaternion, Vector, product, rotation_of
from .vertical import Vertical, levelled, levelling, off_level, variance_of, with_axes_turned

FIRST_VELOCITY = 0.3
"""Standard deviation of the first velocity [m/s]."""
FAST_VELOCITY = 1.0
"""Standard deviation of the velocity after a gap [m/s]."""
LOST = 4.0
"""A variance of the attitude that says no more than the next accelerometer reading [rad^2]."""
LEARNT = 0.1
"""Share of the first variances of the sensors' errors that remains with what right wheels taught
before; more was learnt, but perhaps some of it in doubt."""
LEARNT_BIAS = 0.01
"""The same of the gyro's bias; its variance until now is added to that."""
DRIFTING = 60.0
"""So long may the gyro's bias go on as it did when wheels were right last [s]."""
BELIEVED = 0.5
"""Share of its attitude's variance that the navigation is granted at rest."""
AT_REST_OFF = 0.03
"""So far the navigation may be off the vertical at rest, whatever its variance [rad]."""
MOVING_OFF = 0.05
"""The same in motion [rad]."""
FAR_OFF = 6.0
"""Square of the distance from the vertical, in its variances, beyond which its tilt is taken."""


class Restarted(NamedTuple):
    """A navigation that has begun again."""

    navigation: Navigation
    vertical: Vertical
    covariance: Array


def begin_navigation(
    attitude: Quaternion, bias: Vector, velocity: Vector = (0.0, 0.0, 0.0)
) -> Navigation:
    """Return a navigation without known errors but the gyro's bias."""
    zeros = (0.0, 0.0, 0.0)
    return Navigation(
        attitude=attitude,
        velocity=velocity,
        position=zeros,
        distance=0.0,
        gyro_bias=bias,
        gyro_gain=zeros,
        accel_bias=zeros,
        excess=0.0,
        exceeded=0.0,
        lever_up=0.0,
        wheel_radius=0.0,
        gyro_cross=0.0,
        bend=(0.0, 0.0),
        lever_left=0.0,
    )


def first_covariance(tilt: float, c: Coefficients) -> Array:
    """Return the covariance of a navigation that begins with a variance of its tilt [rad^2]."""
    p = np.zeros((STATES, STATES))
    for i in range(3):
        p[VELOCITY + i, VELOCITY + i] = FIRST_VELOCITY * FIRST_VELOCITY
        p[POSITION + i, POSITION + i] = c.geometry.room * c.geometry.room
        p[GYRO_BIAS + i, GYRO_BIAS + i] = c.gyro_bias * c.gyro_bias
        p[GYRO_GAIN + i, GYRO_GAIN + i] = c.gyro_gain * c.gyro_gain
        p[ACCEL_BIAS + i, ACCEL_BIAS + i] = c.accel_bias * c.accel_bias
    p[LEVER_LEFT, LEVER_LEFT] = c.lever_left * c.lever_left
    p[LEVER_UP, LEVER_UP] = c.lever_arm * c.lever_arm
    p[WHEEL_RADIUS, WHEEL_RADIUS] = c.wheel_radius * c.wheel_radius
    p[GYRO_CROSS, GYRO_CROSS] = c.gyro_cross * c.gyro_cross
    p[BEND, BEND] = p[BEND + 1, BEND + 1] = c.accel_residual * c.accel_residual
    p[ATTITUDE, ATTITUDE] = p[ATTITUDE + 1, ATTITUDE + 1] = tilt
    return p


def doubt_swing(p: Array, swing: Vector) -> None:
    """Let the first velocity be off by all of the swing it holds, in place: one reading tells it.

    Args:
        p: covariance.
        swing: velocity of the sensor against the axle, level axes [m/s].
    """
    for i in range(3):
        for j in range(3):
            p[VELOCITY + i, VELOCITY + j] += swing[i] * swing[j]


def next_covariance(
    tilt: float, learnt: bool, before: Array, drift: Vector, c: Coefficients
) -> Array:
    """Return that of one that begins again.

    Args:
        tilt: variance of its tilt [rad^2].
        learnt: whether it has learnt from right wheels.
        before: covariance until now.
        drift: how fast the gyro's bias changed when that was learnt [rad/s^2].
        c: coefficients.
    """
    p = first_covariance(tilt, c)
    if learnt:
        for axis in range(3):
            i, off = GYRO_BIAS + axis, DRIFTING * drift[axis]
            known = LEARNT_BIAS * p[i, i] + before[i, i] + off * off
            p[i, i] = min(p[i, i], known)
        for i in range(GYRO_GAIN, STATES):
            p[i, i] *= LEARNT
    return p


def contradicted(vertical: Vertical, p: Array, still: bool) -> bool:
    """Whether the navigation is to begin again from the vertical.

    Args:
        vertical: as gyro and accelerometer have it.
        p: the navigation's covariance.
        still: whether the body lies still.
    """
    square, variance = off_level(vertical), variance_of(vertical)
    tilts = float(p[0, 0] + p[1, 1])
    if not tilts < LOST:
        return True
    if still:
        return square > 6.0 * (variance + BELIEVED * tilts) + AT_REST_OFF * AT_REST_OFF
    return square > 16.0 * (variance + tilts) + MOVING_OFF * MOVING_OFF


def restarted_at_vertical(
    nav: Navigation,
    vertical: Vertical,
    p: Array,
    memory: LearntBefore,
    lost: bool,
    off: bool,
    learnt: bool,
    c: Coefficients,
) -> Restarted:
    """Begin the navigation again at the vertical, or near it with its variance.

    Args:
        nav: as it is.
        vertical: as gyro and accelerometer have it.
        p: covariance, changed in place.
        memory: what was learnt before the wheels came into doubt.
        lost: whether a gap hid how it turned; its sensors are as known as before.
        off: whether the vertical contradicts it.
        learnt: whether it has learnt from right wheels.
        c: coefficients.
    """
    variance, attitude = variance_of(vertical), nav.attitude
    if lost or off or off_level(vertical) > FAR_OFF * variance:
        level = levelling(vertical)
        attitude = product(level, attitude)
        vertical = levelled(vertical, level)
    else:
        variance = max(variance, off_level(vertical), p[0, 0], p[1, 1])
    if lost:
        begin_motion(p, variance, c.geometry.room)
        return Restarted(moved_afresh(nav, attitude), vertical, p)
    afresh = recalled(begin_navigation(attitude, vertical.bias), memory.older)
    p = next_covariance(variance, learnt, p, bias_drift(memory), c)
    return Restarted(afresh, vertical, p)


def restarted_at_beginning(
    nav: Navigation,
    vertical: Vertical,
    beginning: Beginning,
    before: Array,
    memory: LearntBefore,
    learnt: bool,
    c: Coefficients,
) -> Restarted:
    """Begin the navigation again where its beginning and the gyro alone have it.

    Args:
        nav: as it is.
        vertical: as gyro and accelerometer have it.
        beginning: of the navigation, and the repairs since.
        before: covariance.
        memory: what was learnt before the wheels came into doubt.
        learnt: whether it has learnt from right wheels.
        c: coefficients.
    """
    (x, y), (ahead, aside) = beginning.turned, beginning.sped
    turn, variance = (-x, -y, 0.0), beginning.variance
    attitude = product(rotation_of(turn), nav.attitude)
    velocity = nav.velocity[0] - ahead, nav.velocity[1] - aside, 0.0
    afresh = recalled(begin_navigation(attitude, vertical.bias, velocity), memory.older)
    p = next_covariance(variance, learnt, before, bias_drift(memory), c)
    push = STANDARD_GRAVITY * beginning.lasted
    for axis, other, gain in ((0, 1, push), (1, 0, -push)):
        p[VELOCITY + axis, VELOCITY + axis] += gain * gain * variance
        p[VELOCITY + axis, ATTITUDE + other] = gain * variance
        p[ATTITUDE + other, VELOCITY + axis] = gain * variance
    return Restarted(afresh, with_axes_turned(vertical, turn), p)


def moved_afresh(nav: Navigation, attitude: Quaternion) -> Navigation:
    """Return a navigation of which only the sensors' errors are known."""
    return recalled(begin_navigation(attitude, nav.gyro_bias), learnt_by(nav))


def begin_motion(p: Array, tilt: float, room: float) -> None:
    """Make attitude, velocity, position and distance independent of all else, in place."""
    for i in range(GYRO_BIAS):
        forget(p, i, 0.0)
    p[ATTITUDE, ATTITUDE] = p[ATTITUDE + 1, ATTITUDE + 1] = tilt
    for i in range(3):
        p[VELOCITY + i, VELOCITY + i] = FAST_VELOCITY * FAST_VELOCITY
        p[POSITION + i, POSITION + i] = room * room
