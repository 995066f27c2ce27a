"""The backward sweep: Rauch, Tung and Striebel's smoother over a block of windows.

Rauch, Tung, Striebel 1965, Maximum likelihood estimates of linear dynamic systems; here on
the errors of an inertial navigation that was repaired after every measurement.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..filters.inertial.error_state import STATES, Array

TINY = 1e-12
"""Added to the diagonal of the scaled covariance that is inverted."""


class BackwardState(NamedTuple):
    """Smoothed state of a window, as the window before it needs it."""

    prior: Array
    """Covariance before the window's measurements, (s, s)."""
    transition: Array
    """Transition from the error after the window before, (s, s)."""
    found: Array
    """Smoothed error of the state before the measurements, (s,)."""
    covariance: Array
    """Covariance of that state, smoothed, (s, s)."""


def final_state() -> BackwardState:
    """Return the state to begin with, at the end of a recording."""
    zeros = np.zeros((STATES, STATES))
    return BackwardState(np.eye(STATES), zeros, np.zeros(STATES), zeros.copy())


def step_back(
    later: BackwardState, prior: Array, posterior: Array, transition: Array, found: Array
) -> tuple[BackwardState, Array]:
    """Go back by one window.

    Args:
        later: smoothed state of the next window.
        prior: of this window, (s, s).
        posterior: (s, s).
        transition: (s, s).
        found: error that its own measurements give, (s,).

    Returns:
        The smoothed state of this window, and the error of its state after its measurements, (s,).
    """
    gain = np.ascontiguousarray(_inverse_times(later.prior, later.transition @ posterior).T)
    error = gain @ later.found
    covariance = posterior + gain @ (later.covariance - later.prior) @ gain.T
    covariance = 0.5 * (covariance + covariance.T)
    return BackwardState(prior, transition, found + error, covariance), error


def _inverse_times(p: Array, right: Array) -> Array:
    """Return P^-1 B for a covariance, whose entries without variance count as known."""
    scale = np.ones(STATES)
    for i in range(STATES):
        if p[i, i] > 0.0:
            scale[i] = 1.0 / np.sqrt(p[i, i])
    column = scale.reshape(STATES, 1)
    scaled = p * column * scale
    for i in range(STATES):
        scaled[i, i] = 1.0 + TINY if p[i, i] > 0.0 else 1.0
    return column * np.linalg.solve(scaled, column * right)
