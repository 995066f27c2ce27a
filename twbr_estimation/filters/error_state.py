"""The covariance of an inertial navigation error, and what a measurement does to it.

The error vector has 21 entries: attitude (3, level axes), velocity (3), position (3),
distance rolled (1), gyro bias (3), gyro gain (3), accelerometer bias (3), the rate beyond
the gyro's range (1) and the lever arm's height (1). Functions change the arrays they are given.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .strapdown import Matrix, Vector

STATES = 21
"""Length of the error vector."""
ATTITUDE, VELOCITY, POSITION, DISTANCE = 0, 3, 6, 9
GYRO_BIAS, GYRO_GAIN, ACCEL_BIAS, EXCESS = 10, 13, 16, 19
LEVER_UP = 20

Array = NDArray[np.float64]


def advanced(
    p: Array,
    time: float,
    turn: Matrix,
    spin: Matrix,
    excess: Vector,
    push: Vector,
    heading: tuple[float, float],
    drift: float,
    leak: float,
) -> Array:
    """Return the covariance one window later, F P F'.

    Args:
        p: covariance, (21, 21), symmetric.
        time: length of the window [s].
        turn: integral of the matrix from body to level axes [s].
        spin: the same with each column times the gyro's reading [rad].
        excess: integral of its second column while the gyro was saturated [s].
        push: integral of the specific force, level axes [m/s].
        heading: level direction the robot faces.
        drift: sideways velocity times the window [m].
        leak: share of the position that is forgotten.
    """
    for _ in range(2):
        p = p.T.copy()
        add_rows(p, 9, 3, time * heading[0], time * heading[1], 0.0)
        for j in range(STATES):
            p[9, j] += drift * p[2, j]
        for i in range(3):
            for j in range(STATES):
                p[6 + i, j] += time * p[3 + i, j] - leak * p[6 + i, j]
        add_rows(p, 3, 0, 0.0, push[2], -push[1])
        add_rows(p, 4, 0, -push[2], 0.0, push[0])
        add_rows(p, 5, 0, push[1], -push[0], 0.0)
        for i in range(3):
            row = 3 * i
            add_rows(p, 3 + i, 16, -turn[row], -turn[row + 1], -turn[row + 2])
            add_rows(p, i, 10, -turn[row], -turn[row + 1], -turn[row + 2])
            add_rows(p, i, 13, spin[row], spin[row + 1], spin[row + 2])
            for j in range(STATES):
                p[i, j] += excess[i] * p[19, j]
    return p


def add_rows(p: Array, to: int, first: int, a: float, b: float, c: float) -> None:
    """Add multiples of three rows, `first` and the next two, to another."""
    for j in range(STATES):
        p[to, j] += a * p[first, j] + b * p[first + 1, j] + c * p[first + 2, j]


def observe(
    p: Array, error: Array, h: Array, residual: float, variance: float, slow: float, gains: float
) -> None:
    """Take in one scalar measurement, in a form that keeps the covariance symmetric.

    For any gain K, P <- P - K (h'P) - (Ph) K' + K s K' is the Joseph form written out; a
    gain smaller than the optimal one is the partial-update Schmidt-Kalman filter (Brink 2017).

    Args:
        p: covariance, (21, 21).
        error: estimated error so far, (21,).
        h: the measurement's slopes, (21,).
        residual: measured minus predicted before any correction.
        variance: of the measurement.
        slow: share of the correction that biases, gains and lever arm take; the rest of
            it stays uncertainty that is only considered.
        gains: the share of that which the gyro gains take.
    """
    spread = np.zeros(STATES)
    for i in range(STATES):
        if h[i] != 0.0:
            for j in range(STATES):
                spread[j] += h[i] * p[i, j]
    scatter, expected = variance, 0.0
    for i in range(STATES):
        if h[i] != 0.0:
            scatter += h[i] * spread[i]
            expected += h[i] * error[i]
    gain = spread / scatter
    gain[GYRO_BIAS:EXCESS] *= slow
    gain[GYRO_GAIN:ACCEL_BIAS] *= gains
    gain[LEVER_UP] *= slow
    error += (residual - expected) * gain
    rest = spread - 0.5 * scatter * gain
    for i in range(STATES):
        for j in range(STATES):
            p[i, j] -= gain[i] * rest[j] + rest[i] * gain[j]


def scatter_of(p: Array, h: Array) -> float:
    """Return the variance of h'x."""
    total = 0.0
    for i in range(STATES):
        if h[i] != 0.0:
            for j in range(STATES):
                total += h[i] * h[j] * p[i, j]
    return float(total)


def forget(p: Array, index: int, variance: float) -> None:
    """Make one entry independent of all others, with a variance of its own."""
    p[index, :] = 0.0
    p[:, index] = 0.0
    p[index, index] = variance
