"""Inertial navigation from sample to sample, and what it tells the covariance.

The mechanisation of `ins_odometer`: body rates and specific forces, freed of the errors
estimated so far, are integrated to attitude, velocity, position and distance along the
heading (trapezoidal rule, coning included).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..samples import STANDARD_GRAVITY, CorrectedSample
from .error_state import (
    ACCEL_BIAS,
    DISTANCE,
    EXCESS,
    GYRO_BIAS,
    GYRO_GAIN,
    LEVER_UP,
    POSITION,
    VELOCITY,
    Array,
)
from .strapdown import (
    Matrix,
    Quaternion,
    Vector,
    heading_of,
    matrix_of,
    product,
    rotated,
    rotation_of,
    turned,
)

GYRO_SATURATED = 1.0
"""A variance of the rate above this marks a saturated gyro [(rad/s)^2]."""
ACCEL_SATURATED = 10.0
"""A variance of the specific force above this marks a clipped one [(m/s^2)^2]."""
SATURATION_MEMORY = 0.02
"""How long the error of a saturated roll or yaw rate stays alike [s]."""
SHOCK = 1.0
"""Change of velocity that one clipped sample may hide [m/s]."""
JUMP = 0.25
"""Variance of the mean between two samples per square of their difference; a jump at an
unknown instant alone gives 1/12."""

_ZEROS = (0.0, 0.0, 0.0)
_NO_TURN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


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
    """Tilt rate beyond the gyro's range while it is saturated [rad/s]."""
    lever_up: float
    """What to add to the height of the lever arm [m]."""


class Reading(NamedTuple):
    """What the last sample said."""

    rate: Vector
    """Angular rate freed of the estimated errors, body axes [rad/s]."""
    force: Vector
    """Specific force freed of the estimated errors, level axes [m/s^2]."""
    gyro: Vector
    accel: Vector


class Window(NamedTuple):
    """What the covariance needs to know of the samples since its last update."""

    time: float
    """Length [s]."""
    turn: Matrix
    """Integral of the matrix from body to level axes [s]."""
    spin: Matrix
    """The same with each column times the gyro's reading [rad]."""
    excess: Vector
    """Integral of its second column while the gyro was saturated [s]."""
    push: Vector
    """Integral of the specific force, level axes [m/s]."""
    attitude_noise: Vector
    """Variance added to the attitude [rad^2]."""
    velocity_noise: Vector
    """Variance added to the velocity [(m/s)^2]."""


def empty_window() -> Window:
    """Return a window without samples."""
    return Window(0.0, _NO_TURN, _NO_TURN, _ZEROS, _ZEROS, _ZEROS, _ZEROS)


def gyro_saturated(sample: CorrectedSample) -> bool:
    """Whether the tilt rate was beyond the gyro's range."""
    return sample.gyro_variance_y > GYRO_SATURATED


def clipped(sample: CorrectedSample) -> bool:
    """Whether any sensor was beyond its range."""
    gyro = sample.gyro_variance_x + sample.gyro_variance_y + sample.gyro_variance_z
    accel = sample.accel_variance_x + sample.accel_variance_y + sample.accel_variance_z
    return gyro > GYRO_SATURATED or accel > ACCEL_SATURATED


def read(nav: Navigation, attitude: Quaternion, rate: Vector, sample: CorrectedSample) -> Reading:
    """Return what to remember of a sample."""
    force = (
        sample.accel_x - nav.accel_bias[0],
        sample.accel_y - nav.accel_bias[1],
        sample.accel_z - nav.accel_bias[2],
    )
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    return Reading(rate, rotated(matrix_of(attitude), force), gyro, accel)


def body_rate(nav: Navigation, sample: CorrectedSample) -> Vector:
    """Return the angular rate freed of the estimated errors [rad/s]."""
    gain, bias = nav.gyro_gain, nav.gyro_bias
    excess = nav.excess if gyro_saturated(sample) else 0.0
    return (
        (1.0 + gain[0]) * sample.gyro_x - bias[0],
        (1.0 + gain[1]) * sample.gyro_y - bias[1] + excess,
        (1.0 + gain[2]) * sample.gyro_z - bias[2],
    )


def integrate(
    nav: Navigation, last: Reading, sample: CorrectedSample, lever: Vector, room_time: float
) -> tuple[Navigation, Reading]:
    """Move on by one sample.

    Args:
        nav: the navigation at the last sample.
        last: what that sample said.
        sample: the new one.
        lever: position of the sensor relative to the axle's middle, body axes [m].
        room_time: time over which displacements are forgotten [s].
    """
    dt = sample.dt
    rate = body_rate(nav, sample)
    attitude = turned(nav.attitude, last.rate, rate, dt)
    now = read(nav, attitude, rate, sample)
    half, v, leak = 0.5 * dt, nav.velocity, min(dt / room_time, 1.0)
    gain = (
        half * (last.force[0] + now.force[0]),
        half * (last.force[1] + now.force[1]),
        half * (last.force[2] + now.force[2]) - dt * STANDARD_GRAVITY,
    )
    step = (dt * (v[0] + 0.5 * gain[0]), dt * (v[1] + 0.5 * gain[1]), dt * (v[2] + 0.5 * gain[2]))
    p, m = nav.position, matrix_of(attitude)
    forward, left = heading_of(m)
    arm = rotated(m, lever)
    yaw = m[6] * rate[0] + m[7] * rate[1] + m[8] * rate[2]
    rolled = step[0] * forward + step[1] * left + dt * yaw * (arm[1] * forward - arm[0] * left)
    moved = Navigation(
        attitude,
        (v[0] + gain[0], v[1] + gain[1], v[2] + gain[2]),
        (
            p[0] * (1.0 - leak) + step[0],
            p[1] * (1.0 - leak) + step[1],
            p[2] * (1.0 - leak) + step[2],
        ),
        nav.distance + rolled,
        nav.gyro_bias,
        nav.gyro_gain,
        nav.accel_bias,
        nav.excess,
        nav.lever_up,
    )
    return moved, now


def extend(
    window: Window, nav: Navigation, last: Reading, now: Reading, sample: CorrectedSample
) -> Window:
    """Add one sample to the window."""
    dt, m, t, s = sample.dt, matrix_of(nav.attitude), window.turn, window.spin
    x, y, z = dt * sample.gyro_x, dt * sample.gyro_y, dt * sample.gyro_z
    e, f = window.excess, window.push
    while_saturated = dt if gyro_saturated(sample) else 0.0
    turning, pushing = _noise(last, sample)
    return Window(
        window.time + dt,
        (
            t[0] + dt * m[0], t[1] + dt * m[1], t[2] + dt * m[2],
            t[3] + dt * m[3], t[4] + dt * m[4], t[5] + dt * m[5],
            t[6] + dt * m[6], t[7] + dt * m[7], t[8] + dt * m[8],
        ),
        (
            s[0] + x * m[0], s[1] + y * m[1], s[2] + z * m[2],
            s[3] + x * m[3], s[4] + y * m[4], s[5] + z * m[5],
            s[6] + x * m[6], s[7] + y * m[7], s[8] + z * m[8],
        ),
        (
            e[0] + while_saturated * m[1],
            e[1] + while_saturated * m[4],
            e[2] + while_saturated * m[7],
        ),
        (f[0] + dt * now.force[0], f[1] + dt * now.force[1], f[2] + dt * now.force[2]),
        _spread(window.attitude_noise, m, turning),
        _spread(window.velocity_noise, m, pushing),
    )  # fmt: skip


def _noise(last: Reading, sample: CorrectedSample) -> tuple[Vector, Vector]:
    """Return the variances of this sample's turn [rad^2] and push [(m/s)^2], body axes."""
    g, a, dt = last.gyro, last.accel, sample.dt
    known = 0.0 if gyro_saturated(sample) else sample.gyro_variance_y
    turning = (
        _turn_noise(sample.gyro_variance_x, sample.gyro_x - g[0], dt),
        _turn_noise(known, sample.gyro_y - g[1], dt),
        _turn_noise(sample.gyro_variance_z, sample.gyro_z - g[2], dt),
    )
    pushing = (
        _push_noise(sample.accel_variance_x, sample.accel_x - a[0], dt),
        _push_noise(sample.accel_variance_y, sample.accel_y - a[1], dt),
        _push_noise(sample.accel_variance_z, sample.accel_z - a[2], dt),
    )
    return turning, pushing


def _turn_noise(variance: float, jump: float, dt: float) -> float:
    memory = max(dt, SATURATION_MEMORY) if variance > GYRO_SATURATED else dt
    return dt * (memory * variance + dt * JUMP * jump * jump)


def _push_noise(variance: float, jump: float, dt: float) -> float:
    if variance > ACCEL_SATURATED:
        return SHOCK * SHOCK
    return dt * dt * (variance + JUMP * jump * jump)


def _spread(total: Vector, m: Matrix, variance: Vector) -> Vector:
    """Add body variances to those along the level axes."""
    x, y, z = variance
    return (
        total[0] + m[0] * m[0] * x + m[1] * m[1] * y + m[2] * m[2] * z,
        total[1] + m[3] * m[3] * x + m[4] * m[4] * y + m[5] * m[5] * z,
        total[2] + m[6] * m[6] * x + m[7] * m[7] * y + m[8] * m[8] * z,
    )


def repaired(nav: Navigation, error: Array) -> Navigation:
    """Return the navigation freed of an estimated error vector."""
    turn = (float(error[0]), float(error[1]), float(error[2]))
    return Navigation(
        product(rotation_of(turn), nav.attitude),
        _plus(nav.velocity, error, VELOCITY),
        _plus(nav.position, error, POSITION),
        nav.distance + float(error[DISTANCE]),
        _plus(nav.gyro_bias, error, GYRO_BIAS),
        _plus(nav.gyro_gain, error, GYRO_GAIN),
        _plus(nav.accel_bias, error, ACCEL_BIAS),
        nav.excess + float(error[EXCESS]),
        nav.lever_up + float(error[LEVER_UP]),
    )


def _plus(vector: Vector, error: Array, first: int) -> Vector:
    return (
        vector[0] + float(error[first]),
        vector[1] + float(error[first + 1]),
        vector[2] + float(error[first + 2]),
    )


def decayed(vector: Vector, keep: float) -> Vector:
    """Return a vector times a number."""
    return keep * vector[0], keep * vector[1], keep * vector[2]


def share_kept(time: float, time_constant: float) -> float:
    """Return what is left of a first-order process after some time."""
    return math.exp(-time / time_constant)
