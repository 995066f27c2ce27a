"""What a window of samples does to the covariance of the navigation's error.

Groves 2013, section 14.2: the transition over a window, in level axes, and the noise that
the sensors, wandering biases and slipping wheels add.
"""

from __future__ import annotations

import numpy as np

from ..samples import STANDARD_GRAVITY
from .error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    BEND,
    DISTANCE,
    EXCESS,
    GYRO_BIAS,
    GYRO_CROSS,
    GYRO_GAIN,
    MOVING,
    POSITION,
    STATES,
    VELOCITY,
    WHEEL_RADIUS,
    Array,
    advanced,
    fade,
)
from .ins_parameters import Coefficients
from .navigation import Navigation, Reading, Window, share_kept
from .strapdown import heading_of

SCALE_MEMORY = 0.1
"""How long the error from the accelerometer's scale stays alike [s]."""


def transition(nav: Navigation, now: Reading, window: Window, c: Coefficients) -> Array:
    """Return what a window adds to attitude, velocity, position and distance errors.

    Returns:
        The first rows of the transition matrix, less the identity, (10, 25).
    """
    time, body, turn, push = window.time, now.body, window.turn, window.push
    forward, left = heading_of(body)
    leak = min(time / c.room_time, 1.0)
    f = np.zeros((MOVING, STATES))
    f[VELOCITY, ATTITUDE + 1], f[VELOCITY, ATTITUDE + 2] = push[2], -push[1]
    f[VELOCITY + 1, ATTITUDE], f[VELOCITY + 1, ATTITUDE + 2] = -push[2], push[0]
    f[VELOCITY + 2, ATTITUDE], f[VELOCITY + 2, ATTITUDE + 1] = push[1], -push[0]
    f[DISTANCE, VELOCITY], f[DISTANCE, VELOCITY + 1] = time * forward, time * left
    f[DISTANCE, ATTITUDE + 2] = time * (nav.velocity[1] * forward - nav.velocity[0] * left)
    f[DISTANCE, WHEEL_RADIUS] = -time * (nav.velocity[0] * forward + nav.velocity[1] * left)
    for i in range(3):
        f[POSITION + i, VELOCITY + i] = time
        f[POSITION + i, POSITION + i] = -leak
        f[ATTITUDE + i, EXCESS] = window.saturated * body[3 * i + 1]
        f[ATTITUDE + i, GYRO_CROSS] = turn[2] * body[3 * i]
        f[VELOCITY + i, BEND] = -window.bend[0] * body[3 * i]
        f[VELOCITY + i, BEND + 1] = -window.bend[1] * body[3 * i]
        for j in range(3):
            along = body[3 * i + j]
            f[ATTITUDE + i, GYRO_BIAS + j] = -time * along
            f[ATTITUDE + i, GYRO_GAIN + j] = turn[j] * along
            f[VELOCITY + i, ACCEL_BIAS + j] = -time * along
    return f


def propagated(
    covariance: Array, nav: Navigation, now: Reading, window: Window, c: Coefficients
) -> Array:
    """Return the covariance at the end of a window."""
    time, body, slip = window.time, now.body, c.geometry.slip
    p = advanced(covariance, transition(nav, now, window, c))
    keep = share_kept(time, c.accel_bias_time)
    fade(p, ACCEL_BIAS, ACCEL_BIAS + 3, keep)
    wander = c.accel_bias * c.accel_bias * (1.0 - keep * keep)
    drift = c.gyro_drift * c.gyro_drift * time
    scale = c.accel_scale * c.accel_scale * SCALE_MEMORY * _acceleration_squared(window) * time
    a, b, d = window.turn_noise
    e, f, g = window.push_noise
    for i in range(3):
        x, y, z = body[3 * i], body[3 * i + 1], body[3 * i + 2]
        p[ATTITUDE + i, ATTITUDE + i] += x * x * a + y * y * b + z * z * d
        p[VELOCITY + i, VELOCITY + i] += x * x * e + y * y * f + z * z * g + scale
        p[GYRO_BIAS + i, GYRO_BIAS + i] += drift
        p[ACCEL_BIAS + i, ACCEL_BIAS + i] += wander
    forward, left = heading_of(body)
    ahead = nav.velocity[0] * forward + nav.velocity[1] * left
    p[DISTANCE, DISTANCE] += slip * slip * abs(ahead) * time
    return p


def _acceleration_squared(window: Window) -> float:
    """Return the square of the mean acceleration [(m/s^2)^2]."""
    x, y = window.push[0] / window.time, window.push[1] / window.time
    z = window.push[2] / window.time - STANDARD_GRAVITY
    return x * x + y * y + z * z
