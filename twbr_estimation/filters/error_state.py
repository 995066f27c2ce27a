"""The covariance of an inertial navigation error, and what a measurement does to it.

The error vector has 21 entries: attitude (3, level axes), velocity (3), position (3),
distance rolled (1), gyro bias (3), gyro gain (3), accelerometer bias (3), the rate beyond
the gyro's range (1) and the lever arm's height (1). Functions change the arrays they are given.

Row operations are spelled twice: with whole rows for the interpreter, and in loops for the
compiler, which would allocate a row for every intermediate. Both do the same operations on
each element in the same order, so the results are the same to the last bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .base import compiled_as
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
    skew = (0.0, push[2], -push[1], -push[2], 0.0, push[0], push[1], -push[0], 0.0)
    steer = (time * heading[0], time * heading[1], 0.0)
    for _ in range(2):
        p = p.T.copy()
        add_rows(p, DISTANCE, VELOCITY, steer)
        add_rows(p, DISTANCE, ATTITUDE, (0.0, 0.0, drift))
        move(p, time, leak)
        add_block(p, VELOCITY, ATTITUDE, skew, 1.0)
        add_block(p, VELOCITY, ACCEL_BIAS, turn, -1.0)
        add_block(p, ATTITUDE, GYRO_BIAS, turn, -1.0)
        add_block(p, ATTITUDE, GYRO_GAIN, spin, 1.0)
        spread_row(p, ATTITUDE, EXCESS, excess)
    return p


def _add_rows_in_loops(p: Array, to: int, first: int, weights: Vector) -> None:
    a, b, c = weights
    for j in range(STATES):
        p[to, j] += a * p[first, j] + b * p[first + 1, j] + c * p[first + 2, j]


@compiled_as(_add_rows_in_loops)
def add_rows(p: Array, to: int, first: int, weights: Vector) -> None:
    """Add multiples of three rows, `first` and the next two, to another."""
    a, b, c = weights
    p[to] += a * p[first] + b * p[first + 1] + c * p[first + 2]


def _add_block_in_loops(p: Array, to: int, first: int, block: Matrix, sign: float) -> None:
    for i in range(3):
        a, b, c = sign * block[3 * i], sign * block[3 * i + 1], sign * block[3 * i + 2]
        for j in range(STATES):
            p[to + i, j] += a * p[first, j] + b * p[first + 1, j] + c * p[first + 2, j]


@compiled_as(_add_block_in_loops)
def add_block(p: Array, to: int, first: int, block: Matrix, sign: float) -> None:
    """Add a 3x3 matrix times three rows, `first` and on, to the three rows `to` and on."""
    m = sign * np.array(block).reshape(3, 3)
    x, y, z = p[first], p[first + 1], p[first + 2]
    p[to : to + 3] += m[:, :1] * x + m[:, 1:2] * y + m[:, 2:] * z


def _move_in_loops(p: Array, time: float, leak: float) -> None:
    for i in range(3):
        for j in range(STATES):
            p[POSITION + i, j] += time * p[VELOCITY + i, j] - leak * p[POSITION + i, j]


@compiled_as(_move_in_loops)
def move(p: Array, time: float, leak: float) -> None:
    """Add velocity times `time` to the position, and forget a share of it."""
    position = p[POSITION : POSITION + 3]
    position += time * p[VELOCITY : VELOCITY + 3] - leak * position


def _spread_row_in_loops(p: Array, to: int, row: int, weights: Vector) -> None:
    for i in range(3):
        for j in range(STATES):
            p[to + i, j] += weights[i] * p[row, j]


@compiled_as(_spread_row_in_loops)
def spread_row(p: Array, to: int, row: int, weights: Vector) -> None:
    """Add multiples of one row to the three rows `to` and on."""
    p[to : to + 3] += np.array(weights).reshape(3, 1) * p[row]


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
    spread = weighted_rows(p, h)
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
    subtract_pair(p, gain, rest)


def _weighted_rows_in_loops(p: Array, h: Array) -> Array:
    total = np.zeros(STATES)
    for i in range(STATES):
        if h[i] != 0.0:
            for j in range(STATES):
                total[j] += h[i] * p[i, j]
    return total


@compiled_as(_weighted_rows_in_loops)
def weighted_rows(p: Array, h: Array) -> Array:
    """Return h'P."""
    total = np.zeros(STATES)
    for i in np.flatnonzero(h):
        total += h[i] * p[i]
    return total


def _subtract_pair_in_loops(p: Array, gain: Array, rest: Array) -> None:
    for i in range(STATES):
        for j in range(STATES):
            p[i, j] -= gain[i] * rest[j] + rest[i] * gain[j]


@compiled_as(_subtract_pair_in_loops)
def subtract_pair(p: Array, gain: Array, rest: Array) -> None:
    """Subtract K r' + r K' from the covariance."""
    p -= gain[:, np.newaxis] * rest + rest[:, np.newaxis] * gain


def scatter_of(p: Array, h: Array) -> float:
    """Return the variance of h'x."""
    spread = weighted_rows(p, h)
    total = 0.0
    for i in range(STATES):
        if h[i] != 0.0:
            total += h[i] * spread[i]
    return float(total)


def forget(p: Array, index: int, variance: float) -> None:
    """Make one entry independent of all others, with a variance of its own."""
    p[index, :] = 0.0
    p[:, index] = 0.0
    p[index, index] = variance
