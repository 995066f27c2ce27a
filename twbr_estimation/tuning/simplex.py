"""Nelder and Mead's simplex, the method of Laddach 2022: downhill without slopes, across kinks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..recording import FloatArray

_SMALL = 1e-4  # a simplex of this size has arrived
_ALIKE = 1e-5  # so have corners whose figures differ by this share


def shrink_simplex(
    run: Callable[[FloatArray], float],
    place: FloatArray,
    sizes: FloatArray,
    low: FloatArray,
    high: FloatArray,
    evaluations: int,
) -> None:
    """Look for a better place around one; `run` remembers what was best.

    Args:
        run: gives the figure of a place.
        place: where to begin, (n,).
        sizes: of the edges of the first simplex, (n,).
        low: least place, (n,).
        high: largest place, (n,).
        evaluations: how many at most, about.
    """
    left = evaluations

    def look(corner: FloatArray) -> tuple[float, FloatArray]:
        nonlocal left
        left -= 1
        inside = np.clip(corner, low, high)
        return run(inside), inside

    inward = np.where(place + sizes > high, -sizes, sizes)
    corners = [look(place), *(look(place + step) for step in np.diag(inward))]
    while left > 0:
        corners.sort(key=lambda corner: corner[0])
        (best, at), (worst, away) = corners[0], corners[-1]
        extent = max(float(np.max(np.abs(corner - at))) for _, corner in corners)
        if extent < _SMALL or abs(worst - best) <= _ALIKE * abs(best):
            return
        middle = np.mean([corner for _, corner in corners[:-1]], axis=0)
        found = look(middle + (middle - away))
        if found[0] < best:
            found = min(found, look(middle + 2.0 * (middle - away)), key=lambda each: each[0])
        elif found[0] >= corners[-2][0]:
            nearer = found[1] if found[0] < worst else away
            found = look(0.5 * (middle + nearer))
        if found[0] < worst:
            corners[-1] = found
        else:
            corners[1:] = [look(0.5 * (at + corner)) for _, corner in corners[1:]]
