"""Robust linear regression of time series, with errors that allow for their correlation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray

HUBER = 2.0
"""Residuals beyond this many standard deviations count less and less."""
BIWEIGHT = 4.685
"""Later on, residuals beyond this many do not count at all."""
ITERATIONS = 10
_NORMAL_MAD = 1.4826  # standard deviation of normal noise over its median absolute deviation


@dataclass(frozen=True, slots=True)
class Regression:
    """Coefficients of a linear model."""

    values: FloatArray
    """Estimates, (k,)."""
    covariance: FloatArray
    """Their covariance, (k, k)."""
    deviation: float
    """Robust standard deviation of the residuals."""

    @property
    def errors(self) -> FloatArray:
        """Standard errors, (k,)."""
        errors: FloatArray = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return errors


def regress(design: FloatArray, target: FloatArray, blocks: FloatArray) -> Regression:
    """Fit `target` by the columns of `design`, Huber-weighted least squares.

    The covariance is the sandwich estimator over blocks: residuals within a block may be
    correlated in any way.

    Args:
        design: (n, k); columns may differ in size, they are scaled inside.
        target: (n,).
        blocks: block of each row, (n,), integers.
    """
    size = np.sqrt(np.mean(np.square(design), axis=0))
    size[size == 0.0] = 1.0
    scaled = design / size
    weights = np.ones(target.size)
    for iteration in range(ITERATIONS):
        root = np.sqrt(weights)
        values = np.linalg.lstsq(scaled * root[:, None], target * root, rcond=None)[0]
        residual = target - scaled @ values
        deviation = _NORMAL_MAD * float(np.median(np.abs(residual)))
        relative = np.abs(residual) / max(deviation, 1e-300)
        if iteration < ITERATIONS // 2:
            weights = np.minimum(1.0, HUBER / np.maximum(relative, 1e-300))
        else:
            weights = np.square(np.maximum(1.0 - np.square(relative / BIWEIGHT), 0.0))
    inverse = np.linalg.pinv(scaled.T @ (scaled * weights[:, None]), hermitian=True)
    scores = scaled * (weights * residual)[:, None]
    _, members = np.unique(blocks, return_inverse=True)
    sums = np.stack([np.bincount(members, column) for column in scores.T], axis=1)
    count = sums.shape[0]
    middle = sums.T @ sums * (count / max(count - design.shape[1], 1))
    covariance = inverse @ middle @ inverse / np.outer(size, size)
    return Regression(values / size, covariance, deviation)
