"""What the inertial navigation is compared with: wheels, room, and the gyro's own range.

Each function takes in scalar measurements; arrays are changed in place.
"""

import math
from typing import NamedTuple

from ...samples import CorrectedSample, is_saturated, is_silent, wrapped
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
from .navigation import TILT_RATE, YAW_RATE, InertialReading, Navigation, rate_beyond
from .stillness import STILL_AFTER
from .strapdown import Vector, cross, heading_of, rotated

HOLD = 1.0
"""Biases and gains are left alone for this long after a saturation and after the start [s]."""
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
SLOW_CHANGE = 25.0
"""Errors that change within longer need not be brought up to date more often than that [s]."""
BALANCING_RATE = 1.5
"""A body that turns faster may fall, and is neither slow nor where it was [rad/s]."""
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
SPIN_MEAN, SPIN_SPREAD, SPIN_TIME = 2.0, 4.0, 2.0
"""Mean [rad/s], spread [rad/s] and time [s] of a yaw rate beyond the range, which lasts."""
LEVEL_ACROSS = 0.07
"""Standard deviation of the lean to the side of a robot on its wheels [rad]."""
STEPPED = 0.08
"""Time over which the error of a coarse encoder's reading stays alike [s]."""
REST_BIAS, REST_TOLD = 0.004, 5.0
"""Standard deviation of the vertical at rest from the accelerometer's own errors [rad]; after the
second time [s] it falls as the rest lasts, since what else could move the vertical is no better."""
FAR_OFF = 4.0
"""Where the attitude's variance is so many times that of the direction at rest, it goes there."""
LONGEST_REST = 2.0
"""Longer rest says no more [s]."""
DRIFT_TIME = 3.0
"""Time over which corrections of the gyro's bias are averaged [s]."""
USUAL_DRIFT = 3e-4
"""A mean rate of correction that says nothing [rad/s^2]."""
FASTEST_DRIFT = 4e-3
"""No bias drifts faster, not even that of a gyro which warms up [rad/s^2]."""
REVERSAL_TIME = 10.0
"""A bias drifts one way: corrected faster than that both ways within this time [s], it is wrong
wheels that push it."""


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
    yaw_per_difference: float
    """Turn about the vertical per difference of two wheels' angles; 0 where it is unknown."""


class Aiding(NamedTuple):
    """What the comparisons remember."""

    calm: float
    """Time since the last saturation, or since the navigation began [s]."""
    unchecked: float
    """Time since the last comparison with the room [s]."""
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
    drifting: tuple[float, float]
    """Mean rates at which the biases of the roll's and the tilt's gyro were corrected of late
    [rad/s^2]."""
    to_and_fro: tuple[float, float]
    """Largest of the tilt's of late, one way and the other [rad/s^2]."""


def begin_aiding(sample: CorrectedSample) -> Aiding:
    """Begin with wheels that have not been used yet."""
    return Aiding(
        calm=0.0,
        unchecked=0.0,
        wheels=0.0,
        slipping=0.0,
        surprise=1.0,
        angle=sample.wheel_angle,
        turned=0.0,
        drifting=(0.0, 0.0),
        to_and_fro=(0.0, 0.0),
    )


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
    keep_gains: bool,
) -> Aiding:
    """Compare with all that is known at this sample, `time` [s] after the last comparison.

    Of the encoders, `wheels` are used, which count in steps of `step` [rad]. Where `keep_gains`
    the gyro's gains stay as they are.

    Returns:
        What to remember.
    """
    slipping, square = 0.0, 1.0
    may_slip = aiding.slipping < LONGEST_SLIP
    slow = 1.0 if aiding.calm >= HOLD and may_slip else 0.0
    gains = 0.0 if keep_gains else 1.0
    if wheels > 0.0:
        square = _wheel(p, error, nav, now, sample, slow, gains, geometry, may_slip, step, time)
        if square > SLIP_GATE * SLIP_GATE:
            slipping = aiding.slipping + time
            if may_slip:
                square = SLIP_GATE * SLIP_GATE
    spins = nav.exceeded == YAW_RATE and wheels > 0.0 and not keep_gains
    if wheels > 1.5 or spins:
        observe_side(p, error, nav, now, slow, gains, geometry)
    if spins:
        observe_level(p, error, now, slow, gains)
    unchecked = aiding.unchecked
    if unchecked >= ROOM_PERIOD:
        observe_room(p, error, nav, now, wheels, slow, gains, geometry)
        unchecked = 0.0
    share = min(time / SURPRISE_TIME, 1.0)
    surprise = aiding.surprise + share * (square - aiding.surprise)
    return Aiding(
        calm=aiding.calm,
        unchecked=unchecked,
        wheels=wheels,
        slipping=slipping,
        surprise=surprise,
        angle=aiding.angle,
        turned=aiding.turned,
        drifting=aiding.drifting,
        to_and_fro=aiding.to_and_fro,
    )


def fading_time(aiding: Aiding, changes: float, time: float) -> float:
    """Return over which time errors of the accelerometer fade at this comparison [s]; 0 if none.

    Those that change slowly wait for a comparison with the room.

    Args:
        aiding: before this comparison.
        changes: time over which the errors change [s].
        time: since the last one [s].
    """
    if changes < SLOW_CHANGE:
        return time
    return aiding.unchecked if aiding.unchecked >= ROOM_PERIOD else 0.0


def drift_noise(drifting: float, time: float) -> float:
    """Return the variance [(rad/s)^2] that a bias gains which keeps being corrected one way.

    Args:
        drifting: mean rate of correction [rad/s^2].
        time: since it gained some last [s].
    """
    fast = min(drifting * drifting, FASTEST_DRIFT * FASTEST_DRIFT)
    beyond = fast - USUAL_DRIFT * USUAL_DRIFT
    return 2.0 * DRIFT_TIME * time * max(beyond, 0.0)


def is_pushed(aiding: Aiding) -> bool:
    """Whether the bias of the tilt's gyro is pushed to and fro."""
    return min(aiding.to_and_fro) > FASTEST_DRIFT


def with_correction(aiding: Aiding, correction: tuple[float, float], time: float) -> Aiding:
    """Return the memory after two biases were corrected [rad/s], `time` [s] after the last time."""
    share = min(time / DRIFT_TIME, 1.0)
    (x, y), (a, b) = aiding.drifting, correction
    x, y = x + share * (a / time - x), y + share * (b / time - y)
    (to, fro), keep = aiding.to_and_fro, max(1.0 - time / REVERSAL_TIME, 0.0)
    if aiding.calm >= HOLD:
        to, fro = max(keep * to, y), max(keep * fro, -y)
    return Aiding(
        calm=aiding.calm,
        unchecked=aiding.unchecked,
        wheels=aiding.wheels,
        slipping=aiding.slipping,
        surprise=aiding.surprise,
        angle=aiding.angle,
        turned=aiding.turned,
        drifting=(x, y),
        to_and_fro=(to, fro),
    )


def lever_of(nav: Navigation, geometry: Geometry) -> Vector:
    """Return the lever arm as estimated [m]."""
    lever = geometry.lever
    return lever[0], lever[1] + nav.lever_left, lever[2] + nav.lever_up


def rolled_distance(
    nav: Navigation, now: InertialReading, sample: CorrectedSample, geometry: Geometry
) -> float:
    """Return the distance of the sensor along the heading as the wheels tell it [m]."""
    m = now.body
    forward, left = heading_of(m)
    arm = rotated(m, lever_of(nav, geometry))
    angle = sample.wheel_angle + geometry.on_body * now.tilt
    return geometry.wheel_radius * angle + arm[0] * forward + arm[1] * left


def whole_turns_less(distance: float, geometry: Geometry) -> float:
    """Return a small difference of distances [m] without the turn that the tilt makes at 180 deg.

    Of an encoder on the body, which the tilt is added to.
    """
    radius = geometry.wheel_radius
    return radius * wrapped(distance / radius) if geometry.on_body > 0.0 else distance


def _wheel(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    sample: CorrectedSample,
    slow: float,
    gains: float,
    geometry: Geometry,
    may_slip: bool,
    step: float,
    time: float,
) -> float:
    """Compare the distance moved with the distance rolled; a slip opens the distance.

    Returns:
        The squared difference over its variance.
    """
    h = wheel_slopes(nav, now, geometry)
    residual = rolled_distance(nav, now, sample, geometry) - nav.distance
    if now.body[8] < 0.0:
        residual = whole_turns_less(residual, geometry)
    variance = reading_variance(geometry, step, time)
    square = residual * residual / (scatter_of(p, h) + variance)
    if may_slip:
        p[DISTANCE, DISTANCE] += beyond_gate(p, h, residual, variance)
    observe(p, error, h, residual, variance, slow, gains)
    return square


def reading_variance(geometry: Geometry, step: float, time: float) -> float:
    """Return the variance of a wheel reading, `time` [s] after the last [m^2].

    Args:
        geometry: of the robot.
        step: in which the encoder counts [rad]; the error of a coarse one stays while it stands.
        time: since the last comparison [s].
    """
    known = geometry.wheel_noise * geometry.wheel_noise
    rough = 0.5 * geometry.wheel_radius * step
    coarse = max(rough * rough - known, 0.0)
    return known + rough * rough + coarse * max(STEPPED / time - 1.0, 0.0)


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


def begin_distance(p: Array, h: Slopes, variance: float) -> None:
    """Let the distance begin where the wheels tell; errors of what they were compared with stay.

    Args:
        p: covariance, changed in place.
        h: `wheel_slopes`.
        variance: of the reading it begins with [m^2].
    """
    i, j, _, l = h.at
    a, b, _, d = h.by
    forget(p, DISTANCE, 0.0)
    for n in range(STATES):
        p[DISTANCE, n] = -(a * p[i, n] + b * p[j, n] + d * p[l, n])
    scatter = -(a * p[DISTANCE, i] + b * p[DISTANCE, j] + d * p[DISTANCE, l])
    for n in range(STATES):
        p[n, DISTANCE] = p[DISTANCE, n]
    p[DISTANCE, DISTANCE] = scatter + variance


def observe_side(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    slow: float,
    gains: float,
    geometry: Geometry,
) -> None:
    """Wheels on the ground do not move sideways."""
    m = now.body
    forward, left = heading_of(m)
    swing = rotated(m, cross(now.rate, lever_of(nav, geometry)))
    x, y = nav.velocity[0] - swing[0], nav.velocity[1] - swing[1]
    h = Slopes(
        (ATTITUDE + 2, VELOCITY, VELOCITY + 1, VELOCITY + 1),
        (-(x * forward + y * left), -left, forward, 0.0),
    )
    observe(p, error, h, x * left - y * forward, SIDE_SLIP * SIDE_SLIP, slow, gains)


def observe_level(p: Array, error: Array, now: InertialReading, slow: float, gains: float) -> None:
    """A robot on its wheels is about level across.

    While it spins beyond the gyro's range, that and the tilt show how fast. One that leans further,
    held in a hand, is believed to.
    """
    m = now.body
    h = Slopes((ATTITUDE, ATTITUDE + 1, ATTITUDE, ATTITUDE), (m[4], -m[1], 0.0, 0.0))
    variance = LEVEL_ACROSS * LEVEL_ACROSS
    variance += beyond_gate(p, h, m[7], variance)
    observe(p, error, h, -m[7], variance, slow, gains)


def observe_room(
    p: Array,
    error: Array,
    nav: Navigation,
    now: InertialReading,
    wheels: float,
    slow: float,
    gains: float,
    geometry: Geometry,
) -> None:
    """A balancing robot is slow and about where it was unless it falls; wheels know better.

    With two wheels it may be anywhere to its side: there lies after a turn what it drove ahead
    before, and they show that it does not slip.
    """
    x, y, z = nav.position
    forward, left = heading_of(now.body)
    share, room = 1.0 if wheels > 0.0 else geometry.room_share, geometry.room
    gains *= share
    observe(p, error, _displaced(0.0, 0.0, 1.0), -z, room * room, slow, gains)
    if wheels < 1.5:
        side = _displaced(-left, forward, 0.0)
        observe(p, error, side, x * left - y * forward, room * room, slow, gains)
    if wheels == 0.0:
        turning = now.rate[0] * now.rate[0] + now.rate[1] * now.rate[1] + now.rate[2] * now.rate[2]
        less = 1.0 + turning / (BALANCING_RATE * BALANCING_RATE)
        ahead = _displaced(forward, left, 0.0)
        observe(p, error, ahead, -(x * forward + y * left), less * room * room, slow, gains)
        variance = less * geometry.speed * geometry.speed
        for axis in range(VELOCITY, VELOCITY + 3):
            moving = Slopes((axis, axis, axis, axis), (1.0, 0.0, 0.0, 0.0))
            observe(p, error, moving, -nav.velocity[axis - VELOCITY], variance, slow, gains)


def observe_rest(
    p: Array, error: Array, up: Vector, off: float, lasted: float, time: float
) -> None:
    """A body that lies still is as level as the accelerometer has it, and does not move.

    Args:
        p: covariance, changed in place.
        error: estimated error, changed in place.
        up: the vertical in the navigation's level axes.
        off: variance of that direction, an error that stays alike [rad^2].
        lasted: for how long the body lies still [s].
        time: since this was compared last [s].
    """
    alike = min(lasted, LONGEST_REST) / time if lasted - time > STILL_AFTER else 1.0
    bias = REST_BIAS * min(REST_TOLD / lasted, 1.0)
    variance = (off + bias * bias) * max(alike, 1.0)
    across = math.sqrt(up[0] * up[0] + up[1] * up[1])
    turn = math.atan2(across, up[2]) / across if across > 1e-6 else 1.0
    for axis, residual in ((ATTITUDE, turn * up[1]), (ATTITUDE + 1, -turn * up[0])):
        h = Slopes((axis, axis, axis, axis), (1.0, 0.0, 0.0, 0.0))
        open_to = p[axis, axis] > FAR_OFF * variance
        share = FAR_OFF * variance / p[axis, axis] if open_to else 1.0
        observe(p, error, h, residual, share * share * variance, 0.0, 0.0)
        if open_to:
            p[axis, axis] += variance


def _displaced(x: float, y: float, z: float) -> Slopes:
    """Return the slopes of a displacement along an axis."""
    return Slopes((POSITION, POSITION + 1, POSITION + 2, POSITION), (x, y, z, 0.0))


def estimate_excess(p: Array, error: Array, nav: Navigation, sample: CorrectedSample) -> None:
    """Say at the end of a saturation that nothing exceeds the range, or before, not below it.

    One-sided knowledge is used where the estimate contradicts it.
    """
    if nav.excess * _side(sample) < 0.0 or rate_beyond(sample) != nav.exceeded:
        h = Slopes((EXCESS, EXCESS, EXCESS, EXCESS), (1.0, 0.0, 0.0, 0.0))
        observe(p, error, h, -nav.excess, EXCESS_END * EXCESS_END, 0.0, 0.0)


def drifted_excess(p: Array, nav: Navigation, time: float, sample: CorrectedSample) -> float:
    """Let the rate beyond the range change over a window; zero outside saturation."""
    beyond = rate_beyond(sample)
    if (beyond == 0.0 or nav.exceeded != beyond) and p[EXCESS, EXCESS] > 0.0:
        forget(p, EXCESS, 0.0)
    if beyond == 0.0:
        return 0.0
    before = nav.excess if nav.exceeded == beyond else 0.0
    spins, keep = beyond == YAW_RATE, excess_kept(time, beyond)
    mean, spread = (SPIN_MEAN, SPIN_SPREAD) if spins else (EXCESS_MEAN, EXCESS_SPREAD)
    fade(p, EXCESS, EXCESS + 1, keep)
    p[EXCESS, EXCESS] += spread * spread * (1.0 - keep * keep)
    return keep * before + (1.0 - keep) * mean * _side(sample)


def excess_kept(time: float, beyond: float) -> float:
    """Return which share of a rate beyond the range outlives a window of some time [s]."""
    return math.exp(-time / (SPIN_TIME if beyond == YAW_RATE else EXCESS_TIME))


def _side(sample: CorrectedSample) -> float:
    """Return on which side a saturated rate is, 1 or -1; 0 where the chip was silent."""
    if is_silent(sample):
        return 0.0
    tilts = rate_beyond(sample) == TILT_RATE
    return math.copysign(1.0, sample.gyro_y if tilts else sample.gyro_z)


def watched(aiding: Aiding, sample: CorrectedSample) -> Aiding:
    """Return the memory one sample later."""
    calm = 0.0 if is_saturated(sample) else aiding.calm + sample.dt
    turned = aiding.turned + abs(sample.gyro_y) * sample.dt
    if sample.wheel_angle != aiding.angle:
        turned = 0.0
    return Aiding(
        calm=calm,
        unchecked=aiding.unchecked + sample.dt,
        wheels=aiding.wheels,
        slipping=aiding.slipping,
        surprise=aiding.surprise,
        angle=sample.wheel_angle,
        turned=turned,
        drifting=aiding.drifting,
        to_and_fro=aiding.to_and_fro,
    )
