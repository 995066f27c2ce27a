"""How well a mean determines the bias of a sensor whose bias drifts slowly.

The standard error of uncorrelated noise, sigma / sqrt(n), is far too small for a gyro: its
bias wanders over minutes (Laddach 2022, Fig. 8), and readings a second apart share most of
it. Here means of short blocks are modelled as white noise plus a drift whose correlation falls
exponentially. Neither its size nor its correlation time is known, and a short recording
hardly determines them: every pair counts with its restricted likelihood and with a prior for
such sensors, so a recording that is too short is given a large error, not a lucky one.
"""

from __future__ import annotations

import numpy as np

from ..checks.blocks import white_deviation, window_means
from ..recording import FloatArray

BLOCKS = 60
"""Number of blocks a recording is cut into."""
DRIFT_TIMES = (5.0, 300.0)
"""Correlation times of a bias drift that are looked for [s]."""
DRIFT_SPREAD = 3.0
"""Factor by which the drift of one sensor in three is larger or smaller than usual."""
_TIMES, _SIZES = 14, 25


def standard_errors(values: FloatArray, dt: float, usual_drift: float) -> FloatArray:
    """Return the standard error of the mean over time of each column.

    Args:
        values: evenly spaced readings at rest, (n, k).
        dt: their period [s].
        usual_drift: standard deviation of the drift of such sensors, in the readings' unit.

    Returns:
        (k,) in the unit of the readings; the error against the mean over a long time.
    """
    size = max(values.shape[0] // BLOCKS, 1)
    means = window_means(values, size)
    noise = np.square(white_deviation(values)) / size
    pairs = zip(means.T, noise, strict=True)
    errors = [
        _standard_error(column, float(white), size * dt, usual_drift) for column, white in pairs
    ]
    return np.array(errors)


def _standard_error(means: FloatArray, white: float, spacing: float, usual: float) -> float:
    """Return the error of the mean of block means (m,), `spacing` seconds apart."""
    steps = np.linspace(-2.0, 2.0, _SIZES)
    sizes = np.square(usual * DRIFT_SPREAD**steps)
    lags = np.abs(np.subtract.outer(np.arange(means.size), np.arange(means.size))) * spacing
    weights, variances = [], []
    for time in np.geomspace(*DRIFT_TIMES, _TIMES):
        likelihood, variance = _likelihoods(means, white, sizes, np.exp(-lags / time))
        weights.append(likelihood - 0.5 * steps**2)
        variances.append(variance)
    weight = np.exp(np.concatenate(weights) - np.max(weights))
    return float(np.sqrt(np.sum(weight * np.concatenate(variances)) / weight.sum()))


def _likelihoods(
    means: FloatArray, white: float, sizes: FloatArray, correlation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return log-likelihood and variance of the plain mean for each drift variance, (s,)."""
    eigenvalues, vectors = np.linalg.eigh(correlation)
    spectrum = white + sizes[:, None] * np.maximum(eigenvalues, 1e-9)  # (s, m)
    seen, ones = vectors.T @ means, vectors.sum(axis=0)
    information = np.sum(ones**2 / spectrum, axis=1)
    best = np.sum(ones * seen / spectrum, axis=1) / information
    misfit = np.sum((seen - best[:, None] * ones) ** 2 / spectrum, axis=1)
    likelihood = -0.5 * (np.sum(np.log(spectrum), axis=1) + np.log(information) + misfit)
    variance = np.sum(ones**2 * spectrum, axis=1) / means.size**2
    return likelihood, variance
