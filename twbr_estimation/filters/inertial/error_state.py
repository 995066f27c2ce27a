"""The covariance of an inertial navigation error, and what a measurement does to it.

The error vector has 26 entries: attitude (3, level axes), velocity (3), position (3),
distance rolled (1), gyro bias (3), gyro gain (3), accelerometer bias (3), the rate beyond
the gyro's range (1), the lever arm's height (1), the wheel radius (1), the yaw rate that the
gyro feels as roll (1), the bend of the forward accelerometer (2) and the lever arm's place to
the left (1). Functions change the arrays they are given.

Array operations are spelled twice: in few calls for the interpreter, and in loops for the
compiler, which would allocate every intermediate. Both do the same operations on each element
in the same order, so the results are the same to the last bit. Loops over columns end where the
array ends, at `STATES` at most: the compiler makes vectors of them, which suit that length, where
it would only unroll a known number.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base import compiled_as

STATES = 26
"""Length of the error vector."""
ATTITUDE, VELOCITY, POSITION, DISTANCE = 0, 3, 6, 9
GYRO_BIAS, GYRO_GAIN, ACCEL_BIAS, EXCESS = 10, 13, 16, 19
LEVER_UP, WHEEL_RADIUS, GYRO_CROSS, BEND, LEVER_LEFT = 20, 21, 22, 23, 25

Array = NDArray[np.float64]

MOVING = 10
"""The first entries, which others move: attitude, velocity, position, distance."""


def _sources() -> NDArray[np.int64]:
    attitude, accel = range(ATTITUDE, ATTITUDE + 3), range(ACCEL_BIAS, ACCEL_BIAS + 3)
    rows = np.full((MOVING, 8), LEVER_UP)  # which moves nothing, where there is no other
    rows[ATTITUDE : ATTITUDE + 3] = [*range(GYRO_BIAS, GYRO_BIAS + 6), EXCESS, GYRO_CROSS]
    rows[VELOCITY : VELOCITY + 3] = [*attitude, *accel, BEND, BEND + 1]
    rows[POSITION : POSITION + 3, :2] = [[POSITION + i, VELOCITY + i] for i in range(3)]
    rows[DISTANCE, :5] = VELOCITY, VELOCITY + 1, ATTITUDE + 2, WHEEL_RADIUS, LEVER_LEFT
    rows[DISTANCE, 5:7] = ATTITUDE, ATTITUDE + 1
    return np.ascontiguousarray(rows.T)


SOURCES = _sources()
"""What moves each of them over a window: column by column, (8, 10)."""
_TERMS = SOURCES.shape[0]
_COUNTS = (SOURCES != LEVER_UP).sum(0)
_ROWS = SOURCES.ravel()
_BELOW = np.tri(MOVING, dtype=bool)


def _advanced_in_loops(p: Array, weights: Array) -> Array:
    size = min(p.shape[0], STATES)
    q, w = np.empty((size, size)), weights
    # What moves these rows stands in `SOURCES`, too; by name the compiler knows it beforehand.
    for i in range(ATTITUDE, ATTITUDE + 3):
        a, b, c, d = w[0, i], w[1, i], w[2, i], w[3, i]
        e, f, g, h = w[4, i], w[5, i], w[6, i], w[7, i]
        for j in range(size):
            total = a * p[GYRO_BIAS, j] + b * p[GYRO_BIAS + 1, j] + c * p[GYRO_BIAS + 2, j]
            total = total + d * p[GYRO_GAIN, j] + e * p[GYRO_GAIN + 1, j]
            total = total + f * p[GYRO_GAIN + 2, j] + g * p[EXCESS, j] + h * p[GYRO_CROSS, j]
            q[i, j] = p[i, j] + total
    for i in range(VELOCITY, VELOCITY + 3):
        a, b, c, d = w[0, i], w[1, i], w[2, i], w[3, i]
        e, f, g, h = w[4, i], w[5, i], w[6, i], w[7, i]
        for j in range(size):
            total = a * p[ATTITUDE, j] + b * p[ATTITUDE + 1, j] + c * p[ATTITUDE + 2, j]
            total = total + d * p[ACCEL_BIAS, j] + e * p[ACCEL_BIAS + 1, j]
            total = total + f * p[ACCEL_BIAS + 2, j] + g * p[BEND, j] + h * p[BEND + 1, j]
            q[i, j] = p[i, j] + total
    for i in range(POSITION, POSITION + 3):
        a, b = w[0, i], w[1, i]
        for j in range(size):
            q[i, j] = p[i, j] + (a * p[i, j] + b * p[i - 3, j])
    a, b, c, d = w[0, DISTANCE], w[1, DISTANCE], w[2, DISTANCE], w[3, DISTANCE]
    e, f, g = w[4, DISTANCE], w[5, DISTANCE], w[6, DISTANCE]
    for j in range(size):
        total = a * p[VELOCITY, j] + b * p[VELOCITY + 1, j] + c * p[ATTITUDE + 2, j]
        total = total + d * p[WHEEL_RADIUS, j] + e * p[LEVER_LEFT, j]
        q[DISTANCE, j] = p[DISTANCE, j] + (total + f * p[ATTITUDE, j] + g * p[ATTITUDE + 1, j])
    for j in range(MOVING - 1, -1, -1):  # in place: what moves an entry stands before it
        for i in range(j + 1):
            total = 0.0
            for k in range(_COUNTS[j]):
                total += weights[k, j] * q[i, SOURCES[k, j]]
            q[i, j] += total
    for j in range(size):
        for i in range(min(j, MOVING)):
            q[j, i] = q[i, j]
    for i in range(MOVING, size):
        for j in range(MOVING, size):
            q[i, j] = p[i, j]
    return q


@compiled_as(_advanced_in_loops)
def advanced(p: Array, weights: Array) -> Array:
    """Return the covariance one window later, (I + F) P (I + F)'.

    Args:
        p: covariance, (26, 26), symmetric.
        weights: the entries of F that `SOURCES` names, (8, 10).
    """
    moved = weights.repeat(STATES).reshape(_TERMS, MOVING, STATES)
    moved *= p.take(_ROWS, 0).reshape(_TERMS, MOVING, STATES)
    rows = p[:MOVING] + np.add.reduce(moved, 0)
    columns = rows.T.copy()
    moved = weights.repeat(MOVING).reshape(_TERMS, MOVING, MOVING)
    moved *= columns.take(_ROWS, 0).reshape(_TERMS, MOVING, MOVING)
    block = columns[:MOVING] + np.add.reduce(moved, 0)
    q = p.copy()
    q[:MOVING] = rows
    q[MOVING:, :MOVING] = columns[MOVING:]
    q[:MOVING, :MOVING] = np.where(_BELOW, block, block.T)
    return q


class Slopes(NamedTuple):
    """How a scalar measurement depends on the error vector: on four entries at most."""

    at: tuple[int, int, int, int]
    """Which entries; any where the slope is 0."""
    by: tuple[float, float, float, float]


def _observe_in_loops(
    p: Array, error: Array, h: Slopes, residual: float, variance: float, slow: float, gains: float
) -> None:
    i, j, k, l = h.at
    a, b, c, d = h.by
    size = min(p.shape[0], STATES)
    work = np.empty((3, size))
    spread, gain, rest = work[0], work[1], work[2]
    for n in range(size):
        spread[n] = a * p[i, n] + b * p[j, n] + c * p[k, n] + d * p[l, n]
    scatter = variance + (a * spread[i] + b * spread[j] + c * spread[k] + d * spread[l])
    surprise = residual - (a * error[i] + b * error[j] + c * error[k] + d * error[l])
    inverse, half = 1.0 / scatter, 0.5 * scatter
    for n in range(size):
        gain[n] = spread[n] * inverse
    for n in range(GYRO_BIAS, EXCESS):
        gain[n] *= slow
    for n in range(GYRO_GAIN, ACCEL_BIAS):
        gain[n] *= gains
    for n in range(LEVER_UP, size):
        gain[n] *= slow
    for n in range(size):
        error[n] += surprise * gain[n]
        rest[n] = spread[n] - half * gain[n]
    for m in range(size):
        x, y = gain[m], rest[m]
        for n in range(size):
            p[m, n] -= x * rest[n] + y * gain[n]


@compiled_as(_observe_in_loops)
def observe(
    p: Array, error: Array, h: Slopes, residual: float, variance: float, slow: float, gains: float
) -> None:
    """Take in one scalar measurement, in a form that keeps the covariance symmetric.

    For any gain K, P <- P - K (h'P) - (Ph) K' + K s K' is the Joseph form written out; a
    gain smaller than the optimal one is the partial-update Schmidt-Kalman filter (Brink 2017).

    Args:
        p: covariance, (26, 26).
        error: estimated error so far, (26,).
        h: the measurement's slopes.
        residual: measured minus predicted before any correction.
        variance: of the measurement.
        slow: share of the correction that biases, gains, geometry and bend take; the rest of
            it stays uncertainty that is only considered.
        gains: the share of that which the gyro gains take.
    """
    (i, j, k, l), (a, b, c, d) = h
    spread = a * p[i]
    if b != 0.0:
        spread += b * p[j]
    if c != 0.0:
        spread += c * p[k]
    if d != 0.0:
        spread += d * p[l]
    at = spread.item
    scatter = variance + (a * at(i) + b * at(j) + c * at(k) + d * at(l))
    at = error.item
    surprise = residual - (a * at(i) + b * at(j) + c * at(k) + d * at(l))
    gain = spread * (1.0 / scatter)
    if slow != 1.0 or gains != 1.0:
        gain[GYRO_BIAS:EXCESS] *= slow
        gain[GYRO_GAIN:ACCEL_BIAS] *= gains
        gain[LEVER_UP:] *= slow
    error += surprise * gain
    spread -= (0.5 * scatter) * gain
    # Each element is one product, so that BLAS and the loop round alike.
    both = np.dot(gain.reshape(STATES, 1), spread.reshape(1, STATES))
    p -= both + both.T


def scatter_of(p: Array, h: Slopes) -> float:
    """Return the variance of h'x."""
    total = 0.0
    for i, a in zip(h.at, h.by):  # noqa: B905 (the compiler knows no strict)
        for j, b in zip(h.at, h.by):  # noqa: B905
            total += a * b * p[i, j]
    return float(total)


def _forget_in_loops(p: Array, index: int, variance: float) -> None:
    for i in range(STATES):
        p[index, i] = 0.0
        p[i, index] = 0.0
    p[index, index] = variance


@compiled_as(_forget_in_loops)
def forget(p: Array, index: int, variance: float) -> None:
    """Make one entry independent of all others, with a variance of its own."""
    p[index] = 0.0
    p[:, index] = 0.0
    p[index, index] = variance


def _fade_in_loops(p: Array, first: int, end: int, keep: float) -> None:
    for i in range(first, end):
        for j in range(STATES):
            p[i, j] *= keep
    for i in range(STATES):
        for j in range(first, end):
            p[i, j] *= keep


@compiled_as(_fade_in_loops)
def fade(p: Array, first: int, end: int, keep: float) -> None:
    """Multiply the entries from `first` to `end` by a number."""
    p[first:end] *= keep
    p[:, first:end] *= keep


def _themselves(vector: Array) -> Array:
    return vector


@compiled_as(_themselves)
def numbers_of(vector: Array) -> Sequence[float]:
    """Return the entries as plain numbers, which the interpreter adds faster."""
    numbers: list[float] = vector.tolist()
    return numbers
