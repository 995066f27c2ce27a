"""Inertial navigation with the wheels as odometer: nothing is differentiated.

Gyro and accelerometer are integrated to attitude, velocity and position in three
dimensions. An error-state Kalman filter compares the distance moved with the wheel
encoder, and position and sideways motion with what a balancing robot can do; from the
differences it learns the errors of attitude, gyro (bias and gain) and accelerometer.
The gyro's own delay is made good at the end: the estimate is where the last rate has led to.
Wheels are checked at every sample (`wheel_check`); while they contradict the accelerometer they
are ignored, and the navigation begins again from a vertical that has never seen them
(`vertical`) where it contradicts that, with what it had learnt before. A body that lies still is
recognised by gyro and accelerometer (`stillness`), and the vertical is then where the
accelerometer points.
Saturation of a sensor is missing information: a rate beyond the gyro's range is estimated
as a state of its own, a clipped acceleration leaves the velocity open.

Groves, Principles of GNSS, Inertial and Multisensor Integrated Navigation Systems,
chapters 5, 14 and 16; the integration runs at every sample, the Kalman filter at most
every `PERIOD`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..samples import STANDARD_GRAVITY, CorrectedSample, TiltEstimate, is_saturated
from .base import Filter
from .inertial.aiding import (
    EXCESS_TIME,
    HOLD,
    Aiding,
    aid,
    begin_distance,
    drifted_excess,
    estimate_excess,
    observe_rest,
    rolled_distance,
    usable_wheels,
    watched,
    wheel_slopes,
)
from .inertial.error_growth import propagated
from .inertial.error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    BEND,
    DISTANCE,
    GYRO_BIAS,
    GYRO_CROSS,
    GYRO_GAIN,
    LEVER_UP,
    POSITION,
    STATES,
    VELOCITY,
    WHEEL_RADIUS,
    Array,
    forget,
)
from .inertial.navigation import (
    InertialReading,
    Navigation,
    Window,
    decayed,
    empty_window,
    extend,
    gyro_saturated,
    integrate,
    read,
    repaired,
    share_kept,
)
from .inertial.parameters import Coefficients, Parameters, derive
from .inertial.stillness import Stillness, begin_stillness, is_still, noticed, rest_variance
from .inertial.strapdown import (
    Quaternion,
    Vector,
    attitude_at,
    heading_of,
    product,
    tilt_ahead,
)
from .inertial.vertical import (
    Vertical,
    agreed,
    at_rest,
    begin_vertical,
    followed,
    levelled,
    levelling,
    off_level,
    unseen_variance,
    variance_of,
    with_axes_turned,
)
from .inertial.wheel_check import (
    WheelCheck,
    begin_check,
    believed,
    checked,
    proven,
    restarted,
    trustworthy,
)
from .inertial.wheel_remarks import wheel_remarks

PERIOD = 0.0045
"""Shortest time between two updates of the Kalman filter [s]."""
FIRST_TILT = 0.3
"""Standard deviation of a first tilt that says nothing of its own [rad]."""
LOST = 4.0
"""A variance of the attitude that says no more than the next accelerometer reading [rad^2]."""
UNKNOWN_TILT = 2.0
"""The same where the first specific force is not gravity's [rad]."""
IMPLAUSIBLE = 0.4
"""Share of gravity by which a first specific force may differ from it."""
FIRST_VELOCITY = 0.3
"""Standard deviation of the first velocity [m/s]."""


UNSEEN_RATE = 10.0
"""Standard deviation of a rate beyond the gyro's range [rad/s]."""
GAP = 0.03
"""A longer time between two samples hides a motion [s]."""
UNSEEN_TURNING = 20.0
"""Variance of the turn hidden in a gap, per cube of its length [rad^2/s^3]."""
UNSEEN_ACCELERATION = 3.0
"""Standard deviation of the acceleration hidden in a gap [m/s^2]."""
LOST_TURN = 0.05
"""With a larger variance after a gap the attitude begins again from the vertical [rad^2]."""
UNSEEN_WITH_WHEELS = 0.3
"""Share of the variance of unseen turns that remains where wheels correct them."""
BELIEVED = 0.5
"""Share of its attitude's variance that the navigation is granted at rest."""
AT_REST_OFF = 0.03
"""So far the navigation may be off the vertical at rest, whatever its variance [rad]."""
MOVING_OFF = 0.05
"""The same in motion [rad]."""
FAST_VELOCITY = 1.0
"""Standard deviation of the velocity after a gap [m/s]."""
MEMORY_PERIOD = 3.0
"""Time between two memories of what was learnt of the sensors [s]."""


class Learnt(NamedTuple):
    """What the navigation had learnt of its sensors at some time."""

    gyro_bias: Vector
    gyro_gain: Vector
    accel_bias: Vector
    lever_up: float
    wheel_radius: float
    gyro_cross: float
    bend: tuple[float, float]


class LearntBefore(NamedTuple):
    """What it had learnt before the present doubts about its wheels could have begun."""

    older: Learnt
    newer: Learnt
    age: float
    """Of the newer one [s]."""


def _learnt(nav: Navigation) -> Learnt:
    return Learnt(
        nav.gyro_bias,
        nav.gyro_gain,
        nav.accel_bias,
        nav.lever_up,
        nav.wheel_radius,
        nav.gyro_cross,
        nav.bend,
    )


def remembered(memory: LearntBefore, nav: Navigation, sound: bool, time: float) -> LearntBefore:
    """Return the memory some time later; it stands still while wheels are in doubt."""
    if not sound:
        return LearntBefore(memory.older, memory.newer, 0.0)
    if memory.age + time < MEMORY_PERIOD:
        return LearntBefore(memory.older, memory.newer, memory.age + time)
    return LearntBefore(memory.newer, _learnt(nav), 0.0)


def recalled(nav: Navigation, learnt: Learnt) -> Navigation:
    """Return a navigation that knows of its sensors what was learnt before."""
    return Navigation(
        nav.attitude,
        nav.velocity,
        nav.position,
        nav.distance,
        learnt.gyro_bias,
        learnt.gyro_gain,
        learnt.accel_bias,
        nav.excess,
        learnt.lever_up,
        learnt.wheel_radius,
        learnt.gyro_cross,
        learnt.bend,
    )


class State(NamedTuple):
    """The estimate, the navigation behind it, and its covariance."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    navigation: Navigation
    last: InertialReading
    window: Window
    aiding: Aiding
    vertical: Vertical
    stillness: Stillness
    check: WheelCheck
    memory: LearntBefore
    covariance: Array
    """Of the error vector of `error_state`, (25, 25)."""


def reset(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> State:
    """Continue from `estimate`, at rest; the accelerometer tells the roll."""
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    force = math.sqrt(accel[0] * accel[0] + accel[1] * accel[1] + accel[2] * accel[2])
    bias = (0.0, estimate.gyro_bias, 0.0)
    rate = (sample.gyro_x, sample.gyro_y - estimate.gyro_bias, sample.gyro_z)
    nav = _begin_navigation(attitude_at(estimate.tilt - c.gyro_delay * rate[1], accel), bias)
    variance = FIRST_TILT * FIRST_TILT
    if estimate.tilt_variance > 0.0:
        variance = estimate.tilt_variance
    elif abs(force - STANDARD_GRAVITY) > IMPLAUSIBLE * STANDARD_GRAVITY:
        variance = UNKNOWN_TILT * UNKNOWN_TILT
    now = read(nav, rate, sample)
    return State(
        estimate.tilt,
        estimate.rate,
        estimate.gyro_bias,
        variance,
        nav,
        now,
        empty_window(),
        _begin_aiding(sample),
        begin_vertical(now.force, bias, variance),
        begin_stillness(sample),
        begin_check(),
        LearntBefore(_learnt(nav), _learnt(nav), 0.0),
        _first_covariance(variance, c),
    )


def _begin_aiding(sample: CorrectedSample) -> Aiding:
    return Aiding(HOLD, 0.0, 0.0, 0.0, 0.0, 1.0, sample.wheel_angle, 0.0)


def _begin_navigation(attitude: Quaternion, bias: Vector) -> Navigation:
    """Return a navigation at rest without known errors but the gyro's bias."""
    zeros = (0.0, 0.0, 0.0)
    return Navigation(
        attitude, zeros, zeros, 0.0, bias, zeros, zeros, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0)
    )


def _first_covariance(tilt: float, c: Coefficients) -> Array:
    p = np.zeros((STATES, STATES))
    for i in range(3):
        p[VELOCITY + i, VELOCITY + i] = FIRST_VELOCITY * FIRST_VELOCITY
        p[POSITION + i, POSITION + i] = c.geometry.room * c.geometry.room
        p[GYRO_BIAS + i, GYRO_BIAS + i] = c.gyro_bias * c.gyro_bias
        p[GYRO_GAIN + i, GYRO_GAIN + i] = c.gyro_gain * c.gyro_gain
        p[ACCEL_BIAS + i, ACCEL_BIAS + i] = c.accel_bias * c.accel_bias
    p[LEVER_UP, LEVER_UP] = c.lever_arm * c.lever_arm
    p[WHEEL_RADIUS, WHEEL_RADIUS] = c.wheel_radius * c.wheel_radius
    p[GYRO_CROSS, GYRO_CROSS] = c.gyro_cross * c.gyro_cross
    p[BEND, BEND] = p[BEND + 1, BEND + 1] = c.accel_residual * c.accel_residual
    p[ATTITUDE, ATTITUDE] = p[ATTITUDE + 1, ATTITUDE + 1] = tilt
    return p


def step(state: State, sample: CorrectedSample, c: Coefficients) -> State:
    """Integrate one sample; at the end of a window compare and repair."""
    last, was_saturated = state.last, state.aiding.saturated > 0.0
    nav, now = integrate(state.navigation, last, sample, c.geometry.lever, c.room_time)
    window = extend(state.window, last, now, sample)
    aiding = watched(state.aiding, sample)
    stillness = noticed(state.stillness, sample)
    unseen = _unseen_turn(sample)
    vertical = followed(state.vertical, now.body, now.rate, sample, unseen)
    still = is_still(stillness, vertical.bias)
    if still:
        vertical = at_rest(
            vertical,
            now.body,
            stillness.accel,
            stillness.gyro,
            rest_variance(stillness),
            sample.dt,
        )
    elif proven(state.check):
        vertical = agreed(vertical, sample.dt)
    check = checked(
        state.check,
        sample,
        now.body,
        now.rate,
        (0.0, 0.0, 1.0),
        state.tilt_variance,
        c.geometry.lever,
        c.geometry.wheel_radius,
        c.geometry.on_body,
        still,
        unseen > 0.0 or is_saturated(sample),
    )
    if window.time < PERIOD and was_saturated == gyro_saturated(sample):
        return State(
            tilt_ahead(now.body, now.rate, c.gyro_delay),
            now.rate[1],
            nav.gyro_bias[1],
            state.tilt_variance,
            nav,
            now,
            window,
            aiding,
            vertical,
            stillness,
            check,
            state.memory,
            state.covariance,
        )
    return _compare(
        state.covariance,
        nav,
        now,
        window,
        aiding,
        vertical,
        stillness,
        check,
        state.memory,
        sample,
        c,
    )


def _unseen_turn(sample: CorrectedSample) -> float:
    """Return the variance of what the gyro could not see of the last turn [rad^2]."""
    variance = 0.0
    if gyro_saturated(sample):
        variance += UNSEEN_RATE * UNSEEN_RATE * sample.dt * max(sample.dt, EXCESS_TIME)
    if sample.dt > GAP:
        silent = sample.dt - GAP
        variance += UNSEEN_TURNING * silent * silent * silent
    return variance


def _compare(
    covariance: Array,
    nav: Navigation,
    now: InertialReading,
    window: Window,
    aiding: Aiding,
    vertical: Vertical,
    stillness: Stillness,
    check: WheelCheck,
    memory: LearntBefore,
    sample: CorrectedSample,
    c: Coefficients,
) -> State:
    """Bring the covariance up to date, compare with the wheels, repair the navigation."""
    p = propagated(covariance, nav, now, window, c)
    if sample.dt > GAP:
        silent = sample.dt - GAP
        for i in range(2):
            p[ATTITUDE + i, ATTITUDE + i] += UNSEEN_TURNING * silent * silent * silent
        for i in range(3):
            p[VELOCITY + i, VELOCITY + i] += (UNSEEN_ACCELERATION * silent) ** 2
        p[DISTANCE, DISTANCE] += (UNSEEN_ACCELERATION * silent * silent) ** 2
    error = np.zeros(STATES)
    wheels = usable_wheels(aiding, sample) if believed(check) else 0.0
    if wheels > 0.0 and wheels != aiding.wheels:
        error[DISTANCE] = rolled_distance(nav, now, sample, c.geometry) - nav.distance
        begin_distance(p, wheel_slopes(nav, now, c.geometry))
    if aiding.saturated > 0.0:
        estimate_excess(p, error, nav, sample)
    compared = aid(
        p, error, nav, now, sample, wheels, aiding, c.geometry, window.time, check.steps.size
    )
    still = is_still(stillness, vertical.bias)
    if still:
        observe_rest(p, error, vertical.up, window.time)
    fixed = repaired(nav, error)
    keep = share_kept(window.time, c.accel_bias_time)
    fixed = Navigation(
        fixed.attitude,
        fixed.velocity,
        fixed.position,
        fixed.distance,
        fixed.gyro_bias,
        fixed.gyro_gain,
        decayed(fixed.accel_bias, keep),
        drifted_excess(p, fixed.excess, window.time, sample),
        fixed.lever_up,
        fixed.wheel_radius,
        fixed.gyro_cross,
        fixed.bend,
    )
    vertical = with_axes_turned(vertical, (error[0], error[1], error[2]))
    astray = check.ignored > 0.0 and check.since <= window.time
    lost = sample.dt > GAP and _unseen_turn(sample) > LOST_TURN
    off = contradicted(vertical, p, still)
    if astray or lost or off:
        levels = lost or off or off_level(vertical) > 6.0 * variance_of(vertical)
        variance = variance_of(vertical)
        attitude = fixed.attitude
        if levels:
            level = levelling(vertical)
            attitude = product(level, attitude)
            vertical = levelled(vertical, level)
        else:
            variance = max(min(variance, off_level(vertical)), p[0, 0], p[1, 1])
        if lost:
            fixed = _moved_afresh(fixed, attitude)
            begin_motion(p, variance, c.geometry.room)
        else:
            fixed = _begin_navigation(attitude, vertical.bias)
            p = _first_covariance(variance, c)
            if astray:
                fixed = recalled(fixed, memory.older)
        compared = _begin_aiding(sample)
        check = restarted(check)
    sound = wheels == 0.0 or trustworthy(check)
    memory = remembered(memory, fixed, sound and check.doubted == 0.0, window.time)
    now = read(fixed, now.rate, sample)
    doubt = (UNSEEN_WITH_WHEELS if wheels > 0.0 else 1.0) * unseen_variance(vertical)
    return State(
        tilt_ahead(now.body, now.rate, c.gyro_delay),
        now.rate[1],
        fixed.gyro_bias[1],
        max(compared.surprise, 1.0) * tilt_variance(p, heading_of(now.body))
        + doubt
        + c.mounting_variance,
        fixed,
        now,
        empty_window(),
        compared,
        vertical,
        stillness,
        check,
        memory,
        p,
    )


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
        return square > 9.0 * (variance + BELIEVED * tilts) + AT_REST_OFF * AT_REST_OFF
    return square > 16.0 * (variance + tilts) + MOVING_OFF * MOVING_OFF


def _moved_afresh(nav: Navigation, attitude: Quaternion) -> Navigation:
    """Return a navigation of which only the sensors' errors are known."""
    zeros = (0.0, 0.0, 0.0)
    return Navigation(
        attitude,
        zeros,
        zeros,
        0.0,
        nav.gyro_bias,
        nav.gyro_gain,
        nav.accel_bias,
        0.0,
        nav.lever_up,
        nav.wheel_radius,
        nav.gyro_cross,
        nav.bend,
    )


def begin_motion(p: Array, tilt: float, room: float) -> None:
    """Make attitude, velocity, position and distance independent of all else, in place."""
    for i in range(GYRO_BIAS):
        forget(p, i, 0.0)
    p[ATTITUDE, ATTITUDE] = p[ATTITUDE + 1, ATTITUDE + 1] = tilt
    for i in range(3):
        p[VELOCITY + i, VELOCITY + i] = FAST_VELOCITY * FAST_VELOCITY
        p[POSITION + i, POSITION + i] = room * room


def tilt_variance(p: Array, heading: tuple[float, float]) -> float:
    """Return the variance of a turn about the robot's left axis [rad^2]."""
    forward, left = heading
    across = left * left * p[0, 0] + forward * forward * p[1, 1]
    return float(across - 2.0 * left * forward * p[0, 1])


FILTER = Filter(
    name="ins_odometer",
    title="Inertial navigation aided by the wheels as odometer.",
    source="Groves 2013, chapters 5, 14, 16",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
    uses_wheels=True,
    remarks=lambda state: wheel_remarks(state.check),
    wheels_ignored=lambda state: state.check.total,
)
