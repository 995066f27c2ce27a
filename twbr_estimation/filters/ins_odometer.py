"""Inertial navigation with the wheels as odometer: nothing is differentiated.

Gyro and accelerometer are integrated to attitude, velocity and position in three
dimensions. An error-state Kalman filter compares the distance moved with the wheel
encoder, and position and sideways motion with what a balancing robot can do; from the
differences it learns the errors of attitude, gyro (bias and gain) and accelerometer.
The gyro's own delay is made good at the end: the estimate is where the last rate has led to.
Saturation of a sensor is missing information: a rate beyond the gyro's range is estimated
as a state of its own, a clipped acceleration leaves the velocity open.

Groves, Principles of GNSS, Inertial and Multisensor Integrated Navigation Systems,
chapters 5, 14 and 16; the integration runs at every sample, the Kalman filter at most
every `PERIOD`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..samples import CorrectedSample, TiltEstimate
from .base import Filter
from .inertial.aiding import (
    HOLD,
    Aiding,
    aid,
    begin_distance,
    drifted_excess,
    estimate_excess,
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
)
from .inertial.navigation import (
    Navigation,
    Reading,
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
from .inertial.strapdown import attitude_at, heading_of, tilt_ahead

PERIOD = 0.0045
"""Shortest time between two updates of the Kalman filter [s]."""
FIRST_TILT = 0.3
"""Standard deviation of a first tilt that says nothing of its own [rad]."""
LOST = 4.0
"""A variance of the attitude that says no more than the next accelerometer reading [rad^2]."""
FIRST_VELOCITY = 0.3
"""Standard deviation of the first velocity [m/s]."""


class State(NamedTuple):
    """The estimate, the navigation behind it, and its covariance."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    navigation: Navigation
    last: Reading
    window: Window
    aiding: Aiding
    covariance: Array
    """Of the error vector of `error_state`, (25, 25)."""


def reset(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> State:
    """Continue from `estimate`, at rest; the accelerometer tells the roll."""
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    zeros = (0.0, 0.0, 0.0)
    bias = (0.0, estimate.gyro_bias, 0.0)
    rate = (sample.gyro_x, sample.gyro_y - estimate.gyro_bias, sample.gyro_z)
    attitude = attitude_at(estimate.tilt - c.gyro_delay * rate[1], accel)
    nav = Navigation(
        attitude, zeros, zeros, 0.0, bias, zeros, zeros, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0)
    )
    variance = FIRST_TILT * FIRST_TILT
    if estimate.tilt_variance > 0.0:
        variance = estimate.tilt_variance
    return State(
        estimate.tilt,
        estimate.rate,
        estimate.gyro_bias,
        variance,
        nav,
        read(nav, rate, sample),
        empty_window(),
        Aiding(HOLD, 0.0, 0.0, 0.0, 0.0, 1.0, sample.wheel_angle, 0.0),
        _first_covariance(variance, c),
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
            state.covariance,
        )
    return _compare(state.covariance, nav, now, window, aiding, sample, c)


def _compare(
    covariance: Array,
    nav: Navigation,
    now: Reading,
    window: Window,
    aiding: Aiding,
    sample: CorrectedSample,
    c: Coefficients,
) -> State:
    """Bring the covariance up to date, compare with the wheels, repair the navigation."""
    p = propagated(covariance, nav, now, window, c)
    if not p[0, 0] + p[1, 1] < LOST:
        bias = nav.gyro_bias[1]
        return reset(TiltEstimate(sample.angle, sample.gyro_y - bias, bias, 0.0), sample, c)
    error = np.zeros(STATES)
    wheels = usable_wheels(aiding, sample)
    if wheels > 0.0 and wheels != aiding.wheels:
        error[DISTANCE] = rolled_distance(nav, now, sample, c.geometry) - nav.distance
        begin_distance(p, wheel_slopes(nav, now, c.geometry))
    if aiding.saturated > 0.0:
        estimate_excess(p, error, nav, sample)
    compared = aid(p, error, nav, now, sample, wheels, aiding, c.geometry, window.time)
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
    now = read(fixed, now.rate, sample)
    return State(
        tilt_ahead(now.body, now.rate, c.gyro_delay),
        now.rate[1],
        fixed.gyro_bias[1],
        max(compared.surprise, 1.0) * tilt_variance(p, heading_of(now.body)) + c.mounting_variance,
        fixed,
        now,
        empty_window(),
        compared,
        p,
    )


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
)
