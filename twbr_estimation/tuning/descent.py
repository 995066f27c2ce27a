"""Least squares from one setting downhill."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from ..recording import FloatArray
from .merit import Merit

NEAR = 0.03
"""A setting near by, on the searched scale: figures are too rough for smaller differences."""
WORTH = 1e-5
"""A step that makes the figure smaller by a smaller share gains nothing."""
_DIVERGED = 1e6  # each error of a setting that diverges: the step is not taken


def descend(
    run: Callable[[FloatArray], Merit],
    place: FloatArray,
    low: FloatArray,
    high: FloatArray,
    steps: int,
) -> tuple[float, FloatArray]:
    """Return the figure and place that least squares reach within some steps.

    Args:
        run: gives the merit of a place.
        place: where to begin, (n,).
        low: least place, (n,).
        high: largest place, (n,).
        steps: how many at most; each asks for n + 1 merits.
    """
    begun = run(place)
    if _diverges(begun):
        return math.inf, place
    count = begun.errors.size

    def errors(at: FloatArray) -> FloatArray:
        merit = run(at)
        return np.full(count, _DIVERGED) if _diverges(merit) else merit.errors

    def slopes(at: FloatArray) -> FloatArray:
        here, columns = errors(at), []
        for index, step in enumerate(np.where(at + NEAR <= high, NEAR, -NEAR)):
            there = at.copy()
            there[index] += step
            merit = run(there)
            columns.append(np.zeros(count) if _diverges(merit) else (merit.errors - here) / step)
        return np.array(columns).T

    found = least_squares(errors, place, slopes, (low, high), ftol=WORTH, xtol=1e-4, max_nfev=steps)
    return 2.0 * float(found.cost), found.x


def _diverges(merit: Merit) -> bool:
    return not merit.figure < _DIVERGED**2
