"""Small covariances: propagation by a transition and update by a scalar measurement.

Both are written twice: with whole rows for the interpreter, in loops for the compiler, which
needs seconds for each array expression. Both versions do the same operations on each element in
the same order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..base import compiled_as

Array = NDArray[np.float64]


def _advanced_in_loops(p: Array, f: Array, noise: Array) -> Array:
    size = noise.size
    once, twice, result = (
        np.zeros((size, size)),
        np.zeros((size, size)),
        np.empty((size, size)),
    )
    for i in range(size):
        for k in range(size):
            if f[i, k] != 0.0:
                for j in range(size):
                    once[i, j] += f[i, k] * p[k, j]
    for i in range(size):
        for k in range(size):
            if f[i, k] != 0.0:
                for j in range(size):
                    twice[i, j] += f[i, k] * once[j, k]
    for i in range(size):
        for j in range(size):
            result[i, j] = 0.5 * (twice[i, j] + twice[j, i])
        result[i, i] += noise[i]
    return result


@compiled_as(_advanced_in_loops)
def advanced(p: Array, f: Array, noise: Array) -> Array:
    """Return F P F' + Q, with the diagonal `noise` of Q; exactly symmetric.

    Half a rounding error between the two halves would grow with every unstable motion.
    """
    once, twice = np.zeros(p.shape), np.zeros(p.shape)
    for k in range(noise.size):
        once += f[:, k : k + 1] * p[k]
    across = once.T
    for k in range(noise.size):
        twice += f[:, k : k + 1] * across[k]
    result = 0.5 * (twice + twice.T)
    result[np.diag_indices(noise.size)] += noise
    return np.asarray(result, dtype=np.float64)


def _observed_in_loops(
    x: Array, p: Array, h: Array, residual: float, variance: float
) -> tuple[Array, Array]:
    size = x.size
    spread, scatter = np.zeros(size), variance
    for i in range(size):
        if h[i] != 0.0:
            for j in range(size):
                spread[j] += h[i] * p[i, j]
    for i in range(size):
        scatter += h[i] * spread[i]
    after, left = np.empty(size), np.empty((size, size))
    pull = residual / scatter
    for i in range(size):
        after[i] = x[i] + pull * spread[i]
        share = spread[i] / scatter
        for j in range(size):
            left[i, j] = p[i, j] - share * spread[j]
    return after, left


@compiled_as(_observed_in_loops)
def observed(x: Array, p: Array, h: Array, residual: float, variance: float) -> tuple[Array, Array]:
    """Take in one scalar measurement.

    Args:
        x: state, (n,).
        p: its covariance, (n, n), symmetric.
        h: the measurement's slopes, (n,).
        residual: measured minus predicted from `x`.
        variance: of the measurement; above zero.

    Returns:
        State and covariance after it.
    """
    spread, scatter = np.zeros(x.size), variance
    for seen in np.flatnonzero(h):
        spread += h[seen] * p[seen]
    for i in range(x.size):
        scatter += h[i] * spread[i]
    after = x + residual / scatter * spread
    return after, p - (spread / scatter)[:, np.newaxis] * spread


def forget(p: Array, index: int, variance: float) -> None:
    """Make one entry independent of all others, with a given variance; changes `p`."""
    for j in range(p.shape[0]):
        p[index, j] = p[j, index] = 0.0
    p[index, index] = variance


def identity(size: int) -> Array:
    """Return the unit matrix."""
    f = np.zeros((size, size))
    for i in range(size):
        f[i, i] = 1.0
    return f
