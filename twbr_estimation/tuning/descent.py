"""Least squares from one setting downhill: Levenberg's and Marquardt's damped Gauss-Newton steps.

Nocedal and Wright, Numerical Optimization, section 10.3. How the errors depend on each parameter
is found by settings near by, and kept up to date by what the steps show (Broyden's update) until it
no longer leads downhill.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..recording import FloatArray

NEAR = 0.03
"""A setting near by, on the searched scale."""
LONGEST_STEP = 1.5
"""On the searched scale, for each parameter."""
WORTH = 1e-5
"""A step that makes the figure smaller by a smaller share gains nothing."""
REFUSED = 3
"""So many steps in a row that do not lead downhill end the use of a Jacobian."""
_FIRST_DAMPING, _LESS, _MORE = 1e-2, 0.2, 8.0
_FLOOR = 1e-6  # of the largest square of a slope: what a parameter without effect counts for


class Descent:
    """A place on its way downhill."""

    def __init__(
        self, run: Callable[[FloatArray], Any], place: FloatArray, low: FloatArray, high: FloatArray
    ) -> None:
        """Begin at a place.

        Args:
            run: gives the merit of a place: `figure` and `errors`.
            place: where to begin, (n,).
            low: least place, (n,).
            high: largest place, (n,).
        """
        self._run, self._place, self._low, self._high = run, place, low, high
        self._evaluations = 0
        self._here = self._merit(place)
        self._damping = _FIRST_DAMPING
        self._slopes: FloatArray | None = None
        self._ended = not math.isfinite(self._here.figure)

    @property
    def figure(self) -> float:
        """The figure where it is; infinite where that diverges."""
        return float(self._here.figure) if math.isfinite(self._here.figure) else math.inf

    def go_on(self, evaluations: int) -> None:
        """Take steps until they gain nothing, or for so many evaluations."""
        end, fresh, refused = self._evaluations + evaluations, False, 0
        while not self._ended and self._evaluations < end:
            if self._slopes is None:
                self._slopes, fresh, refused = self._differences(), True, 0
            gain = self._try(self._slopes)
            refused = 0 if gain > 0.0 else refused + 1
            if gain > WORTH * self._here.figure:
                fresh = False
            elif gain > 0.0 or refused >= REFUSED:
                self._slopes, self._ended = None, fresh

    def _merit(self, place: FloatArray) -> Any:
        self._evaluations += 1
        return self._run(place)

    def _try(self, slopes: FloatArray) -> float:
        """Take a step if it leads downhill, and return by how much."""
        target = np.clip(self._place + self._step(slopes), self._low, self._high)
        step = target - self._place
        size = float(step @ step)
        there = self._merit(target) if size > 0.0 else self._here
        if not there.figure < self._here.figure:
            self._damping *= _MORE
            return 0.0
        gain = float(self._here.figure - there.figure)
        missed = there.errors - self._here.errors - slopes @ step
        slopes += np.outer(missed, step / size)
        self._place, self._here = target, there
        self._damping = max(_LESS * self._damping, 1e-9)
        return gain

    def _step(self, slopes: FloatArray) -> FloatArray:
        """Return the step that the slopes suggest; none leads out of the bounds."""
        downhill = -(slopes.T @ self._here.errors)
        shut_in = ((self._place <= self._low) & (downhill < 0.0)) | (
            (self._place >= self._high) & (downhill > 0.0)
        )
        normal = slopes.T @ slopes
        weights = np.diag(normal) + _FLOOR * max(float(np.max(np.diag(normal))), 1e-300)
        normal = normal + self._damping * np.diag(weights)
        normal[shut_in], normal[:, shut_in], downhill[shut_in] = 0.0, 0.0, 0.0
        normal[shut_in, shut_in] = 1.0
        step = np.linalg.solve(normal, downhill)
        return np.clip(step, -LONGEST_STEP, LONGEST_STEP)

    def _differences(self) -> FloatArray:
        """Return how the errors change with each parameter, (errors, n); 0 where that diverges."""
        here, columns = self._here.errors, []
        for index, place in enumerate(self._place):
            near = NEAR if place + NEAR <= self._high[index] else -NEAR
            there = self._place.copy()
            there[index] += near
            merit = self._merit(there)
            finite = math.isfinite(merit.figure)
            columns.append((merit.errors - here) / near if finite else np.zeros(here.size))
        return np.array(columns).T.copy()
