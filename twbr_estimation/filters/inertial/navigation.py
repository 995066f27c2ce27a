"""Inertial navigation from sample to sample, and what it tells the covariance.

The mechanisation of `ins_odometer`: body rates and specific forces, freed of the errors
estimated so far, are integrated to attitude, velocity, position and distance along the
heading (trapezoidal rule, coning included).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from ...samples import STANDARD_GRAVITY, CorrectedSample, is_saturated
from .error_state import (
    ACCEL_BIAS,
    BEND,
    DISTANCE,
    EXCESS,
    GYRO_BIAS,
    GYRO_CROSS,
    GYRO_GAIN,
    LEVER_LEFT,
    LEVER_UP,
    POSITION,
    VELOCITY,
    WHEEL_RADIUS,
    Array,
    numbers_of,
)
from .strapdown import (
    Matrix,
    Quaternion,
    Vector,
    cross,
    heading_of,
    matrix_of,
    product,
    rotated,
    rotation_of,
    tilt_of,
    turned,
)

SATURATION_MEMORY = 0.02
"""How long the error of a saturated roll or yaw rate stays alike [s]."""
SHOCK = 1.0
"""Change of velocity that one clipped sample may hide [m/s]."""
JUMP = 0.25
"""Variance of the mean between two readings per square of their difference; a jump at an
unknown instant alone gives 1/12."""
LONGEST_HELD = 0.1
"""A sensor that repeats its reading for longer stands still or is frozen, and is not slow [s]."""
SAME_FORCE = 1e-9
"""Largest cross product of two specific forces that are one reading [m^2/s^4]."""
TILT_RATE, YAW_RATE = 1.0, 2.0
"""The rates of which what is beyond the gyro's range is estimated."""
BEND_AT = 2.0
"""Forward reading at which the accelerometer's bend is stated [m/s^2]."""

_ZEROS = (0.0, 0.0, 0.0)


class Navigation(NamedTuple):
    """Where the sensor is, how it moves, and what is wrong with it."""

    attitude: Quaternion
    velocity: Vector
    """Level axes [m/s]."""
    position: Vector
    """Displacement of late, level axes [m]."""
    distance: float
    """Distance the sensor moved along the robot's heading [m]."""
    gyro_bias: Vector
    gyro_gain: Vector
    """What to add to 1 before a calibrated rate is multiplied by it."""
    accel_bias: Vector
    excess: float
    """Rate beyond the gyro's range [rad/s]."""
    exceeded: float
    """Which rate that is, `TILT_RATE` or `YAW_RATE`; 0 while both are within the range."""
    lever_up: float
    """What to add to the height of the lever arm [m]."""
    wheel_radius: float
    """What to add to 1 before the radius of the wheels is multiplied by it."""
    gyro_cross: float
    """Share of the yaw rate that the roll rate lacks."""
    bend: tuple[float, float]
    """What the forward accelerometer reads too much at -`BEND_AT` and below, and at `BEND_AT`
    and above; in proportion in between [m/s^2]."""
    lever_left: float
    """What to add to the place of the lever arm to the left [m]."""


class InertialReading(NamedTuple):
    """What the last sample said."""

    body: Matrix
    """From body to level axes."""
    tilt: float
    """Of that [rad]."""
    rate: Vector
    """Angular rate freed of the estimated errors, body axes [rad/s]."""
    force: Vector
    """Specific force freed of the estimated errors, level axes [m/s^2]."""
    gyro: Vector
    accel: Vector
    held: tuple[float, float]
    """For how long gyro and accelerometer have read just that: more than 0 where a sensor is
    slower than the samples [s]."""


class Window(NamedTuple):
    """What the covariance needs to know of the samples since its last update.

    A window is short, so body axes are taken for where they point at its end.
    """

    time: float
    """Length [s]."""
    exceeded: tuple[float, float]
    """Time during which the excess was of the tilt rate, and of the yaw rate [s]."""
    turn: Vector
    """Integral of the gyro's reading, body axes [rad]."""
    push: Vector
    """Integral of the specific force, level axes [m/s]."""
    bend: tuple[float, float]
    """Integrals of the shares of each bend that the readings held [s]."""
    turn_noise: Vector
    """Variance of the turn, body axes [rad^2]."""
    push_noise: Vector
    """Variance of the push, body axes [(m/s)^2]."""


def empty_window() -> Window:
    """Return a window without samples."""
    return Window(0.0, (0.0, 0.0), _ZEROS, _ZEROS, (0.0, 0.0), _ZEROS, _ZEROS)


def gyro_saturated(sample: CorrectedSample) -> bool:
    """Whether the tilt rate was beyond the gyro's range."""
    return sample.gyro_saturated_y > 0.0


def rate_beyond(sample: CorrectedSample) -> float:
    """Return which rate an excess is of: the tilt's, else the yaw's; 0 within the gyro's range."""
    if gyro_saturated(sample):
        return TILT_RATE
    return YAW_RATE if sample.gyro_saturated_z > 0.0 else 0.0


def read(
    nav: Navigation, rate: Vector, sample: CorrectedSample, held: tuple[float, float]
) -> InertialReading:
    """Return what to remember of a sample at the attitude of `nav`; see `InertialReading`."""
    return _reading(nav.attitude, nav, rate, sample, held)


def _reading(
    attitude: Quaternion,
    nav: Navigation,
    rate: Vector,
    sample: CorrectedSample,
    held: tuple[float, float],
) -> InertialReading:
    body, bias = matrix_of(attitude), nav.accel_bias
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    back, ahead = bend_shares(accel[0])
    forward = accel[0] - bias[0] - (back * nav.bend[0] + ahead * nav.bend[1])
    force = rotated(body, (forward, accel[1] - bias[1], accel[2] - bias[2]))
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    return InertialReading(body, tilt_of(body), rate, force, gyro, accel, held)


def _held(last: InertialReading, sample: CorrectedSample) -> tuple[float, float]:
    """Return for how long the readings of a sample have been the same [s].

    Beyond its range a sensor repeats the limit, however quick it is.
    """
    if is_saturated(sample):
        return 0.0, 0.0
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z) == last.gyro
    x, y, z = cross(last.accel, (sample.accel_x, sample.accel_y, sample.accel_z))
    accel = max(abs(x), abs(y), abs(z)) < SAME_FORCE  # which may be scaled meanwhile
    rated = min(last.held[0] + sample.dt, LONGEST_HELD) if gyro else 0.0
    felt = min(last.held[1] + sample.dt, LONGEST_HELD) if accel else 0.0
    return rated, felt


def _repeated_for(last: InertialReading, sample: CorrectedSample) -> float:
    """Return for how long a slow gyro had repeated its last reading; 0 of a quick one [s].

    Where one axis alone has another reading, a coarse gyro has left a step that it was right in.
    """
    was, held = last.gyro, last.held[0]
    changed = (sample.gyro_x != was[0]) + (sample.gyro_y != was[1]) + (sample.gyro_z != was[2])
    return held if held < LONGEST_HELD and changed > 1 else 0.0


def awaits_reading(last: InertialReading, now: InertialReading, window: Window) -> bool:
    """Whether a sensor that is slower than the samples will soon say what happened meanwhile.

    One that has just said so ends it: of two that are out of step, one always repeats itself.
    """
    renewed = now.held[0] < last.held[0] or now.held[1] < last.held[1]
    return 0.0 < max(now.held) < LONGEST_HELD and not renewed and window.time < LONGEST_HELD


def bend_shares(forward: float) -> tuple[float, float]:
    """Return which share of each bend a forward reading [m/s^2] holds."""
    share = min(max(forward / BEND_AT, -1.0), 1.0)
    return max(-share, 0.0), max(share, 0.0)


def body_rate(nav: Navigation, sample: CorrectedSample) -> Vector:
    """Return the angular rate freed of the estimated errors [rad/s]."""
    gain, bias = nav.gyro_gain, nav.gyro_bias
    beyond, tilting, turning = rate_beyond(sample), 0.0, 0.0
    if beyond == nav.exceeded:
        if beyond == TILT_RATE:
            tilting = nav.excess
        elif beyond == YAW_RATE:
            turning = nav.excess
    return (
        (1.0 + gain[0]) * sample.gyro_x - bias[0] + nav.gyro_cross * sample.gyro_z,
        (1.0 + gain[1]) * sample.gyro_y - bias[1] + tilting,
        (1.0 + gain[2]) * sample.gyro_z - bias[2] + turning,
    )


def integrate(
    nav: Navigation, last: InertialReading, sample: CorrectedSample, lever: Vector, room_time: float
) -> tuple[Navigation, InertialReading]:
    """Move on by one sample.

    Args:
        nav: the navigation at the last sample.
        last: what that sample said.
        sample: the new one.
        lever: position of the sensor relative to the axle's middle, body axes [m].
        room_time: time over which displacements are forgotten [s].
    """
    dt, v, p = sample.dt, nav.velocity, nav.position
    rate = body_rate(nav, sample)
    attitude = turned(nav.attitude, last.rate, rate, dt, _repeated_for(last, sample))
    now = _reading(attitude, nav, rate, sample, _held(last, sample))
    before, after, half = last.force, now.force, 0.5 * dt
    gain_x = half * (before[0] + after[0])
    gain_y = half * (before[1] + after[1])
    gain_z = half * (before[2] + after[2]) - dt * STANDARD_GRAVITY
    step_x, step_y = dt * (v[0] + 0.5 * gain_x), dt * (v[1] + 0.5 * gain_y)
    step_z = dt * (v[2] + 0.5 * gain_z)
    m, kept = now.body, 1.0 - min(dt / room_time, 1.0)
    forward, left = heading_of(m)
    arm = rotated(m, (lever[0], lever[1] + nav.lever_left, lever[2]))
    yaw = m[6] * rate[0] + m[7] * rate[1] + m[8] * rate[2]
    rolled = step_x * forward + step_y * left + dt * yaw * (arm[1] * forward - arm[0] * left)
    moved = Navigation(
        attitude,
        (v[0] + gain_x, v[1] + gain_y, v[2] + gain_z),
        (p[0] * kept + step_x, p[1] * kept + step_y, p[2] * kept + step_z),
        nav.distance + (1.0 - nav.wheel_radius) * rolled,
        nav.gyro_bias,
        nav.gyro_gain,
        nav.accel_bias,
        nav.excess,
        nav.exceeded,
        nav.lever_up,
        nav.wheel_radius,
        nav.gyro_cross,
        nav.bend,
        nav.lever_left,
    )
    return moved, now


def extend(
    window: Window, last: InertialReading, now: InertialReading, sample: CorrectedSample
) -> Window:
    """Add one sample to the window."""
    dt, force, gyro, was = sample.dt, now.force, now.gyro, last.gyro
    (tilting, turning), beyond = window.exceeded, rate_beyond(sample)
    known_y, known_z, clip_z = sample.gyro_variance_y, sample.gyro_variance_z, 0.0
    if beyond == TILT_RATE:
        tilting, known_y, clip_z = tilting + dt, 0.0, sample.gyro_saturated_z
    elif beyond == YAW_RATE:
        turning, known_z = turning + dt, 0.0
    turn, push, t, p = window.turn, window.push, window.turn_noise, window.push_noise
    accel, before = now.accel, last.accel
    back, ahead = bend_shares(accel[0])
    rated, felt = dt + last.held[0], dt + last.held[1]
    a, b, c = rated * (gyro[0] - was[0]), rated * (gyro[1] - was[1]), rated * (gyro[2] - was[2])
    d, e = felt * (accel[0] - before[0]), felt * (accel[1] - before[1])
    f = felt * (accel[2] - before[2])
    return Window(
        window.time + dt,
        (tilting, turning),
        (turn[0] + dt * gyro[0], turn[1] + dt * gyro[1], turn[2] + dt * gyro[2]),
        (push[0] + dt * force[0], push[1] + dt * force[1], push[2] + dt * force[2]),
        (window.bend[0] + dt * back, window.bend[1] + dt * ahead),
        (
            t[0] + _turn_noise(sample.gyro_variance_x, sample.gyro_saturated_x, a, dt),
            t[1] + _turn_noise(known_y, 0.0, b, dt),
            t[2] + _turn_noise(known_z, clip_z, c, dt),
        ),
        (
            p[0] + _push_noise(sample.accel_variance_x, sample.accel_saturated_x, d, dt),
            p[1] + _push_noise(sample.accel_variance_y, sample.accel_saturated_y, e, dt),
            p[2] + _push_noise(sample.accel_variance_z, sample.accel_saturated_z, f, dt),
        ),
    )


def _turn_noise(variance: float, saturated: float, jump: float, dt: float) -> float:
    """Return the variance of a turn; `jump` is that of the rate times how long it was held."""
    memory = max(dt, SATURATION_MEMORY) if saturated > 0.0 else dt
    return dt * memory * variance + JUMP * jump * jump


def _push_noise(variance: float, saturated: float, jump: float, dt: float) -> float:
    """Return the variance of a push, as `_turn_noise` does."""
    if saturated > 0.0:
        return SHOCK * SHOCK
    return dt * dt * variance + JUMP * jump * jump


def repaired(nav: Navigation, error: Array) -> Navigation:
    """Return the navigation freed of an estimated error vector."""
    e = numbers_of(error)
    return Navigation(
        product(rotation_of((e[0], e[1], e[2])), nav.attitude),
        _plus(nav.velocity, e, VELOCITY),
        _plus(nav.position, e, POSITION),
        nav.distance + e[DISTANCE],
        _plus(nav.gyro_bias, e, GYRO_BIAS),
        _plus(nav.gyro_gain, e, GYRO_GAIN),
        _plus(nav.accel_bias, e, ACCEL_BIAS),
        nav.excess + e[EXCESS],
        nav.exceeded,
        nav.lever_up + e[LEVER_UP],
        nav.wheel_radius + e[WHEEL_RADIUS],
        nav.gyro_cross + e[GYRO_CROSS],
        (nav.bend[0] + e[BEND], nav.bend[1] + e[BEND + 1]),
        nav.lever_left + e[LEVER_LEFT],
    )


def _plus(vector: Vector, numbers: Sequence[float], first: int) -> Vector:
    return (
        vector[0] + numbers[first],
        vector[1] + numbers[first + 1],
        vector[2] + numbers[first + 2],
    )


def faded(nav: Navigation, keep: float, excess: float, exceeded: float) -> Navigation:
    """Return the navigation with a share of the accelerometer's bias, and another excess rate.

    Args:
        nav: as it is.
        keep: that share.
        excess: rate beyond the gyro's range [rad/s].
        exceeded: which rate that is.
    """
    bias = nav.accel_bias
    return Navigation(
        attitude=nav.attitude,
        velocity=nav.velocity,
        position=nav.position,
        distance=nav.distance,
        gyro_bias=nav.gyro_bias,
        gyro_gain=nav.gyro_gain,
        accel_bias=(keep * bias[0], keep * bias[1], keep * bias[2]),
        excess=excess,
        exceeded=exceeded,
        lever_up=nav.lever_up,
        wheel_radius=nav.wheel_radius,
        gyro_cross=nav.gyro_cross,
        bend=nav.bend,
        lever_left=nav.lever_left,
    )


def share_kept(time: float, time_constant: float) -> float:
    """Return what is left of a first-order process after some time."""
    return math.exp(-time / time_constant)
