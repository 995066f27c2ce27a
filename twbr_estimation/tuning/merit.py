"""How good a setting is, and the errors that show where a better one lies."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..recording import FloatArray
from .objective import Objective, Term, TuningSet, figure_of

KEPT_ERRORS = 4096
"""Errors of a setting that a search keeps, of all recordings together."""


class Merit(NamedTuple):
    """How good a setting is."""

    figure: float
    """What is to become small; not finite where the setting diverges."""
    errors: FloatArray
    """Numbers whose squares add up to about the figure, in the same order for all settings."""


USELESS = Merit(math.inf, np.zeros(0))
"""The merit of a setting that must not be chosen."""


def merit_of(
    sets: Sequence[TuningSet], tilt_of: Callable[[TuningSet], FloatArray], objective: Objective
) -> Merit:
    """Return the merit of estimates on recordings: figure and errors are their mean.

    Args:
        sets: the recordings.
        tilt_of: estimates the tilt of one at all its samples [rad], (n,).
        objective: the figure of merit of one.
    """
    figures, errors = [], []
    for each in sets:
        tilt = tilt_of(each)[each.known]
        terms = objective.terms(each.errors(tilt), tilt, each.slope, each.dt, each.joined)
        figures.append(figure_of(terms))
        errors += [thinned(term, KEPT_ERRORS // len(sets)) for term in terms]
    return Merit(float(np.mean(figures)), np.concatenate(errors) / math.sqrt(len(sets)))


def thinned(term: Term, count: int) -> FloatArray:
    """Return no more than about `count` errors, whose squares add up to about the term's figure.

    How they change with a parameter shows the way to a better one; no figure is made of them.
    """
    kept = term.errors[:: max(term.errors.size // max(count, 1), 1)]
    return math.sqrt(term.weight / kept.size) * kept
