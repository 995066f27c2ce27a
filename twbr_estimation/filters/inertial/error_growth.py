"""What a window of samples does to the covariance of the navigation's error.

Groves 2013, section 14.2: the transition over a window, in level axes, and the noise that
the sensors, wandering biases and slipping wheels add.
"""

from __future__ import annotations

import numpy as np

from ...samples import STANDARD_GRAVITY
from .error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    DISTANCE,
    GYRO_BIAS,
    POSITION,
    SOURCES,
    VELOCITY,
    Array,
    advanced,
    fade,
)
from .navigation import InertialReading, Navigation, Window
from .parameters import GUIDED_DRIFT, Coefficients
from .strapdown import heading_of

SCALE_MEMORY = 0.1
"""How long the error from the accelerometer's scale stays alike [s]."""


def transition(nav: Navigation, now: InertialReading, window: Window, c: Coefficients) -> Array:
    """Return how a window moves attitude, velocity, position and distance errors.

    Returns:
        The entries of the transition matrix, less the identity, at `SOURCES`, (8, 10).
    """
    time, body, turn, push = window.time, now.body, window.turn, window.push
    tilting, turning = window.exceeded
    forward, left = heading_of(body)
    leak = min(time / c.room_time, 1.0)
    w = np.zeros(SOURCES.shape)
    for i in range(3):
        x, y, z = body[3 * i], body[3 * i + 1], body[3 * i + 2]
        to = ATTITUDE + i
        w[0, to], w[1, to], w[2, to] = -time * x, -time * y, -time * z
        w[3, to], w[4, to], w[5, to] = turn[0] * x, turn[1] * y, turn[2] * z
        w[6, to], w[7, to] = tilting * y + turning * z, turn[2] * x
        to = VELOCITY + i
        w[3, to], w[4, to], w[5, to] = -time * x, -time * y, -time * z
        w[6, to], w[7, to] = -window.bend[0] * x, -window.bend[1] * x
        w[0, POSITION + i], w[1, POSITION + i] = -leak, time
    w[1, VELOCITY], w[2, VELOCITY] = push[2], -push[1]
    w[0, VELOCITY + 1], w[2, VELOCITY + 1] = -push[2], push[0]
    w[0, VELOCITY + 2], w[1, VELOCITY + 2] = push[1], -push[0]
    w[0, DISTANCE], w[1, DISTANCE] = time * forward, time * left
    w[2, DISTANCE] = time * (nav.velocity[1] * forward - nav.velocity[0] * left)
    w[3, DISTANCE] = -time * (nav.velocity[0] * forward + nav.velocity[1] * left)
    fall = 0.5 * time * push[2]  # a tilted navigation gains velocity within the window, too
    w[5, DISTANCE], w[6, DISTANCE] = -fall * left, fall * forward
    yaw = body[6] * turn[0] + body[7] * turn[1] + body[8] * turn[2]
    w[4, DISTANCE] = yaw * (body[4] * forward - body[1] * left)
    return w


def propagated(
    covariance: Array,
    nav: Navigation,
    now: InertialReading,
    window: Window,
    keep: float,
    wheels: float,
    c: Coefficients,
) -> Array:
    """Return the covariance at the end of a window.

    Args:
        covariance: before it.
        nav: the navigation at its end.
        now: the reading at its end.
        window: what happened within it.
        keep: what the accelerometer's errors keep of themselves.
        wheels: how many encoders the robot has.
        c: coefficients.
    """
    time, body, slip = window.time, now.body, c.geometry.slip
    p = advanced(covariance, transition(nav, now, window, c))
    if keep < 1.0:
        fade(p, ACCEL_BIAS, ACCEL_BIAS + 3, keep)
    wander = c.accel_bias * c.accel_bias * (1.0 - keep * keep)
    drift = c.gyro_drift if wheels == 0.0 else GUIDED_DRIFT * c.gyro_drift
    drift = drift * drift * time
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
