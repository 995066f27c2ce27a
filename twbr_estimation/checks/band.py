"""Derivatives of a signal between two Gaussian low-passes, the same for all signals.

What is left out: noise and steps of encoders above the first, drift of biases below the second.
The kernels are symmetric, so a linear trend vanishes exactly.
"""

from __future__ import annotations

import math

import numpy as np

from ..recording import FloatArray

SHORT = 0.05
"""Standard deviation of the first low-pass [s]."""
LONG = 0.6
"""The same of the second [s]."""
REACH = 4.0
"""Reach of the kernels in standard deviations."""


def banded(values: FloatArray, step: float, order: int = 0) -> FloatArray:
    """Return a derivative of evenly spaced `values` (n,) in the band, (n,).

    Args:
        values: the signal.
        step: its period [s].
        order: of the derivative, 0 to 2.
    """
    short = max(SHORT, step)
    return smoothed(values, step, short, order) - smoothed(values, step, LONG, order)


def smoothed(values: FloatArray, step: float, width: float, order: int = 0) -> FloatArray:
    """Return a derivative of `values` under a Gaussian of standard deviation `width` [s]."""
    kernel = _kernel(width, step, order)
    reach = kernel.size // 2
    padded = np.concatenate([np.full(reach, values[0]), values, np.full(reach, values[-1])])
    result: FloatArray = np.convolve(padded, kernel, "valid")
    return result


def clear_of_ends(count: int, step: float) -> slice:
    """Return the points whose band holds no padding."""
    reach = math.ceil(REACH * LONG / step)
    return slice(reach, max(count - reach, reach))


def _kernel(width: float, step: float, order: int) -> FloatArray:
    reach = math.ceil(REACH * width / step)
    time = np.arange(-reach, reach + 1) * step
    bell = np.exp(-0.5 * np.square(time / width))
    bell /= bell.sum()
    factor = {
        0: np.ones_like(time),
        1: -time / width**2,
        2: np.square(time) / width**4 - 1.0 / width**2,
    }[order]
    kernel: FloatArray = factor * bell
    if order == 1:  # a ramp keeps its slope, a parabola its curvature, whatever the step
        kernel /= -float(np.sum(kernel * time))
    if order == 2:
        kernel -= kernel.mean()
        kernel *= 2.0 / float(np.sum(kernel * np.square(time)))
    return kernel
