"""What the inertial navigation is compared with: wheels, room, and the gyro's own range.

Each function takes in scalar measurements; arrays are changed in place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..samples import CorrectedSample
from .error_state import (
    ATTITUDE,
    DISTANCE,
    EXCESS,
    LEVER_UP,
    POSITION,
    VELOCITY,
    Array,
    Slopes,
    fade,
    forget,
    observe,
    scatter_of,
)
from .navigation import Navigation, Reading, clipped, gyro_saturated
from .strapdown import Vector, cross, heading_of, rotated, tilt_of

HOLD = 1.0
"""Biases and gains are left alone for this long after a saturation [s]."""
SLIP_GATE = 3.0
"""A wheel reading this many standard deviations off is a slip."""
LONGEST_SLIP = 0.3
"""After this the attitude is taken to be wrong, not the wheels nor the calibration [s]."""
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
    """Wheel encoders at the last update."""
    slipping: float
    """Time since the wheels began to disagree [s]; 0 while they agree."""


def aid(
    p: Array,
    error: Array,
    nav: Navigation,
    now: Reading,
    sample: CorrectedSample,
    aiding: Aiding,
    geometry: Geometry,
    time: float,
) -> float:
    """Compare with everything that is known at this sample, `time` after the last comparison.

    Returns:
        Time since the wheels began to disagree [s].
    """
    slipping = 0.0
    slow = 1.0 if aiding.calm >= HOLD and aiding.slipping < LONGEST_SLIP else 0.0
    if sample.wheel_count > 0.0:
        may_slip = aiding.slipping < LONGEST_SLIP
        if _wheel(p, error, nav, now, sample, slow, geometry, may_slip):
            slipping = aiding.slipping + time
    if sample.wheel_count > 1.5:
        observe_side(p, error, nav, now, slow, geometry)
    if aiding.unchecked >= ROOM_PERIOD:
        observe_room(p, error, nav, now, sample.wheel_count, slow, geometry)
    return slipping


def lever_of(nav: Navigation, geometry: Geometry) -> Vector:
    """Return the lever arm as estimated [m]."""
    lever = geometry.lever
    return lever[0], lever[1], lever[2] + nav.lever_up


def rolled_distance(
    nav: Navigation, now: Reading, sample: CorrectedSample, geometry: Geometry
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
    now: Reading,
    sample: CorrectedSample,
    slow: float,
    geometry: Geometry,
    may_slip: bool,
) -> bool:
    """Compare the distance moved with the distance rolled; a slip opens the distance.

    Returns:
        Whether they disagree.
    """
    h = wheel_slopes(nav, now, geometry)
    residual = rolled_distance(nav, now, sample, geometry) - nav.distance
    variance = geometry.wheel_noise * geometry.wheel_noise
    beyond = beyond_gate(p, h, residual, variance)
    if beyond > 0.0 and may_slip:
        p[DISTANCE, DISTANCE] += beyond
    observe(p, error, h, residual, variance, slow, 1.0)
    return beyond > 0.0


def wheel_slopes(nav: Navigation, now: Reading, geometry: Geometry) -> Slopes:
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


def observe_side(
    p: Array, error: Array, nav: Navigation, now: Reading, slow: float, geometry: Geometry
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
    now: Reading,
    wheels: float,
    slow: float,
    geometry: Geometry,
) -> None:
    """A balancing robot stays about where it was; wheels know better along the heading."""
    x, y, z = nav.position
    forward, left = heading_of(now.body)
    gains, room = 1.0 if wheels > 0.0 else geometry.room_share, geometry.room
    observe(p, error, _displaced(0.0, 0.0, 1.0), -z, room * room, slow, gains)
    side = _displaced(-left, forward, 0.0)
    observe(p, error, side, x * left - y * forward, room * room, slow, gains)
    if wheels == 0.0:
        ahead = _displaced(forward, left, 0.0)
        observe(p, error, ahead, -(x * forward + y * left), room * room, slow, gains)


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
    calm = 0.0 if clipped(sample) else aiding.calm + sample.dt
    return Aiding(
        calm, aiding.unchecked + sample.dt, aiding.saturated, aiding.wheels, aiding.slipping
    )
