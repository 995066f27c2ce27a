"""What the inertial navigation is compared with: wheels, room, and the gyro's own range.

Each function takes in scalar measurements; arrays are changed in place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ...samples import CorrectedSample, is_saturated
from .error_state import (
    ATTITUDE,
    DISTANCE,
    EXCESS,
    LEVER_UP,
    POSITION,
    STATES,
    VELOCITY,
    Array,
    Slopes,
    fade,
    forget,
    observe,
    scatter_of,
)
from .navigation import InertialReading, Navigation, gyro_saturated
from .strapdown import Vector, cross, heading_of, rotated, tilt_of

HOLD = 1.0
"""Biases and gains are left alone for this long after a saturation [s]."""
SLIP_GATE = 3.0
"""A wheel reading this many standard deviations off is a slip."""
LONGEST_SLIP = 0.3
"""After this the attitude is taken to be wrong, not the wheels nor the calibration [s]."""
FROZEN_TURN = 0.05
"""An encoder that disagrees and says nothing new while the body turns this far is frozen [rad]."""
SURPRISE_TIME = 0.2
"""Time over which squared innovations of the wheels are averaged [s]."""
FIRST_DISTANCE = 1e-3
"""Standard deviation of the first distance, which fits the first wheel reading [m]."""
ROOM_PERIOD = 0.25
"""Time between two comparisons with the room [s]."""
SIDE_SLIP = 0.1
"""Standard deviation of the axle's sideways velocity on two wheels [m/s]."""
EXCESS_MEAN = 0.8
"""Usual tilt rate beyond the gyro's range while it is saturated [rad/s]."""
EXCESS_SPREAD = 4.0
"""Standard deviation of that rate [rad/s]."""
EXCESS_TIME = 0.05
"""Time over which it changes [s]."""
EXCESS_END = 0.3
"""How well it is known to be zero at the end, and never below zero [rad/s]."""


REST_DENSITY = 0.05
"""Spectral density of the vertical's error at rest [rad^2 s]."""


class Geometry(NamedTuple):
    """What the comparison needs of robot and parameters."""

    lever: Vector
    """Position of the sensor relative to the axle's middle, body axes [m]."""
    wheel_radius: float
    on_body: float
    """1 where the encoder counts against the body, else 0."""
    wheel_noise: float
    slip: float
    room: float
    """Standard deviation of a displacement [m]."""
    speed: float
    """Standard deviation of a velocity [m/s]."""
    room_share: float
    """Share of a correction that the gyro's gains take where only the room corrects."""


class Aiding(NamedTuple):
    """What the comparisons remember."""

    calm: float
    """Time since the last saturation [s]."""
    unchecked: float
    """Time since the last comparison with the room [s]."""
    saturated: float
    """1 while the gyro is saturated, else 0."""
    wheels: float
    """Wheel encoders that were used at the last update."""
    slipping: float
    """Time since the wheels began to disagree [s]; 0 while they agree."""
    surprise: float
    """Squared innovation of the wheels over its variance, of late; a short slip counts little."""
    angle: float
    """Wheel angle one sample ago [rad]."""
    turned: float
    """How far the body turned since that angle changed [rad]."""


def usable_wheels(aiding: Aiding, sample: CorrectedSample) -> float:
    """Return how many wheel encoders tell anything; none where they are frozen."""
    disputed = aiding.wheels == 0.0 or aiding.surprise > 1.0
    if disputed and aiding.turned > FROZEN_TURN:
        return 0.0
    return sample.wheel_count


def aid(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    sample: CorrectedSample,
    wheels: float,
    aiding: Aiding,
    geometry: Geometry,
    time: float,
    step: float,
) -> Aiding:
    """Compare with all that is known at this sample, `time` [s] after the last comparison.

    Of the encoders, `wheels` are used, which count in steps of `step` [rad].

    Returns:
        What to remember.
    """
    slipping, square = 0.0, 1.0
    may_slip = aiding.slipping < LONGEST_SLIP
    slow = 1.0 if aiding.calm >= HOLD and may_slip else 0.0
    if wheels > 0.0:
        square = _wheel(p, error, nav, now, sample, slow, geometry, may_slip, step)
        if square > SLIP_GATE * SLIP_GATE:
            slipping = aiding.slipping + time
            if may_slip:
                square = SLIP_GATE * SLIP_GATE
    if wheels > 1.5:
        observe_side(p, error, nav, now, slow, geometry)
    unchecked = aiding.unchecked
    if unchecked >= ROOM_PERIOD:
        observe_room(p, error, nav, now, wheels, slow, geometry)
        unchecked = 0.0
    saturated = 1.0 if gyro_saturated(sample) else 0.0
    share = min(time / SURPRISE_TIME, 1.0)
    surprise = aiding.surprise + share * (square - aiding.surprise)
    return Aiding(
        aiding.calm,
        unchecked,
        saturated,
        wheels,
        slipping,
        surprise,
        aiding.angle,
        aiding.turned,
    )


def lever_of(nav: Navigation, geometry: Geometry) -> Vector:
    """Return the lever arm as estimated [m]."""
    lever = geometry.lever
    return lever[0], lever[1], lever[2] + nav.lever_up


def rolled_distance(
    nav: Navigation, now: InertialReading, sample: CorrectedSample, geometry: Geometry
) -> float:
    """Return the distance of the sensor along the heading as the wheels tell it [m]."""
    m = now.body
    forward, left = heading_of(m)
    arm = rotated(m, lever_of(nav, geometry))
    angle = sample.wheel_angle + geometry.on_body * tilt_of(m)
    return geometry.wheel_radius * angle + arm[0] * forward + arm[1] * left


def _wheel(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    sample: CorrectedSample,
    slow: float,
    geometry: Geometry,
    may_slip: bool,
    step: float,
) -> float:
    """Compare the distance moved with the distance rolled; a slip opens the distance.

    Returns:
        The squared difference over its variance.
    """
    h = wheel_slopes(nav, now, geometry)
    residual = rolled_distance(nav, now, sample, geometry) - nav.distance
    rough = 0.5 * geometry.wheel_radius * step
    variance = geometry.wheel_noise * geometry.wheel_noise + rough * rough
    square = residual * residual / (scatter_of(p, h) + variance)
    if may_slip:
        p[DISTANCE, DISTANCE] += beyond_gate(p, h, residual, variance)
    observe(p, error, h, residual, variance, slow, 1.0)
    return square


def wheel_slopes(nav: Navigation, now: InertialReading, geometry: Geometry) -> Slopes:
    """Return how distance moved minus distance rolled depends on the error vector."""
    m = now.body
    forward, left = heading_of(m)
    height = rotated(m, lever_of(nav, geometry))[2] + geometry.on_body * geometry.wheel_radius
    return Slopes(
        (ATTITUDE, ATTITUDE + 1, DISTANCE, LEVER_UP),
        (height * left, -height * forward, 1.0, -(m[2] * forward + m[5] * left)),
    )


def beyond_gate(p: Array, h: Slopes, residual: float, variance: float) -> float:
    """Return the variance [m^2] that would bring a wheel reading to the gate; 0 within it."""
    expected = scatter_of(p, h) + variance
    return max(residual * residual - SLIP_GATE * SLIP_GATE * expected, 0.0)


def begin_distance(p: Array, h: Slopes) -> None:
    """Let the distance begin where the wheels tell; errors of what they were compared with stay.

    Args:
        p: covariance, changed in place.
        h: `wheel_slopes`.
    """
    i, j, _, l = h.at
    a, b, _, d = h.by
    forget(p, DISTANCE, 0.0)
    for n in range(STATES):
        p[DISTANCE, n] = -(a * p[i, n] + b * p[j, n] + d * p[l, n])
    scatter = -(a * p[DISTANCE, i] + b * p[DISTANCE, j] + d * p[DISTANCE, l])
    for n in range(STATES):
        p[n, DISTANCE] = p[DISTANCE, n]
    p[DISTANCE, DISTANCE] = scatter + FIRST_DISTANCE * FIRST_DISTANCE


def observe_side(
    p: Array, error: Array, nav: Navigation, now: InertialReading, slow: float, geometry: Geometry
) -> None:
    """Two wheels on the ground do not move sideways."""
    m = now.body
    forward, left = heading_of(m)
    swing = rotated(m, cross(now.rate, lever_of(nav, geometry)))
    x, y = nav.velocity[0] - swing[0], nav.velocity[1] - swing[1]
    h = Slopes(
        (ATTITUDE + 2, VELOCITY, VELOCITY + 1, VELOCITY + 1),
        (-(x * forward + y * left), -left, forward, 0.0),
    )
    observe(p, error, h, x * left - y * forward, SIDE_SLIP * SIDE_SLIP, slow, 1.0)


def observe_room(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    wheels: float,
    slow: float,
    geometry: Geometry,
) -> None:
    """A balancing robot stays about where it was, and is slow; wheels know better."""
    x, y, z = nav.position
    forward, left = heading_of(now.body)
    gains, room = 1.0 if wheels > 0.0 else geometry.room_share, geometry.room
    observe(p, error, _displaced(0.0, 0.0, 1.0), -z, room * room, slow, gains)
    side = _displaced(-left, forward, 0.0)
    observe(p, error, side, x * left - y * forward, room * room, slow, gains)
    if wheels == 0.0:
        ahead = _displaced(forward, left, 0.0)
        observe(p, error, ahead, -(x * forward + y * left), room * room, slow, gains)
        variance = geometry.speed * geometry.speed
        for axis in range(VELOCITY, VELOCITY + 3):
            moving = Slopes((axis, axis, axis, axis), (1.0, 0.0, 0.0, 0.0))
            observe(p, error, moving, -nav.velocity[axis - VELOCITY], variance, slow, gains)


def observe_rest(p: Array, error: Array, up: Vector, time: float) -> None:
    """A body that lies still is as level as the accelerometer has it, and does not move.

    Args:
        p: covariance, changed in place.
        error: estimated error, changed in place.
        up: the vertical in the navigation's level axes.
        time: since this was said last [s].
    """
    variance = REST_DENSITY / time
    for axis, residual in ((ATTITUDE, up[1]), (ATTITUDE + 1, -up[0])):
        h = Slopes((axis, axis, axis, axis), (1.0, 0.0, 0.0, 0.0))
        observe(p, error, h, residual, variance, 0.0, 0.0)


def _displaced(x: float, y: float, z: float) -> Slopes:
    """Return the slopes of a displacement along an axis."""
    return Slopes((POSITION, POSITION + 1, POSITION + 2, POSITION), (x, y, z, 0.0))


def estimate_excess(p: Array, error: Array, nav: Navigation, sample: CorrectedSample) -> None:
    """Say at the end of a saturation that nothing exceeds the range, or before, not below it.

    One-sided knowledge is used where the estimate contradicts it.
    """
    if nav.excess * sample.gyro_y < 0.0 or not gyro_saturated(sample):
        h = Slopes((EXCESS, EXCESS, EXCESS, EXCESS), (1.0, 0.0, 0.0, 0.0))
        observe(p, error, h, -nav.excess, EXCESS_END * EXCESS_END, 0.0, 0.0)


def drifted_excess(p: Array, excess: float, time: float, sample: CorrectedSample) -> float:
    """Let the rate beyond the range change over a window; zero outside saturation."""
    if not gyro_saturated(sample):
        forget(p, EXCESS, 0.0)
        return 0.0
    keep = math.exp(-time / EXCESS_TIME)
    fade(p, EXCESS, EXCESS + 1, keep)
    p[EXCESS, EXCESS] += EXCESS_SPREAD * EXCESS_SPREAD * (1.0 - keep * keep)
    return keep * excess + (1.0 - keep) * math.copysign(EXCESS_MEAN, sample.gyro_y)


def watched(aiding: Aiding, sample: CorrectedSample) -> Aiding:
    """Return the memory one sample later."""
    calm = 0.0 if is_saturated(sample) else aiding.calm + sample.dt
    turned = aiding.turned + abs(sample.gyro_y) * sample.dt
    if sample.wheel_angle != aiding.angle:
        turned = 0.0
    return Aiding(
        calm,
        aiding.unchecked + sample.dt,
        aiding.saturated,
        aiding.wheels,
        aiding.slipping,
        aiding.surprise,
        sample.wheel_angle,
        turned,
    )
