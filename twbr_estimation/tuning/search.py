"""Search for the parameters that make a figure smallest: points everywhere, then least squares.

The figure is a mean of squares, and whoever judges a setting shows the errors behind it as well, so
that a few settings near one say where a better one lies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import minimize

from ..filters.base import Filter, Parameter
from ..recording import FloatArray
from .axis import SearchAxis
from .descent import descend
from .merit import Merit

Judge = Callable[[Mapping[str, float]], Merit]
Progress = Callable[[float, Mapping[str, float]], None]
"""Called after every evaluation with the best figure so far and its values; may raise to stop."""


def no_progress(best: float, values: Mapping[str, float]) -> None:
    """Take no notice of the progress of a search."""


_POINTS = 64  # all over the bounds, per parameter
_GLOBAL_STARTS = 5  # points that are refined beside the given starts
_FIRST_STEPS = 5  # from each start; then the best of them go on
_FINALISTS = 2
_STEPS = 10  # of those
_LAST_STEPS = 30  # of Nelder-Mead around the best, per parameter
_LAST_SIZE = 0.3
GLOBAL_PARAMETERS = 4
"""A filter with more parameters is searched around its starts only, unless thoroughly."""
_FEW_STEPS = 40  # of Nelder-Mead; what fits one minute better by more steps fits others worse
_SMALL = 1e-4  # a simplex of this size has arrived, where its figures differ
_ALIKE = 1e-5  # by a smaller share of the best
_FEW_SIZE = 0.1, 0.7  # share of the bounds, and limit, of its first edges


@dataclass(frozen=True, slots=True)
class SearchResult:
    """The best parameters met in a search."""

    values: dict[str, float]
    figure: float
    evaluations: int


class _Search:
    """Counts evaluations and remembers the best."""

    def __init__(self, axes: Mapping[str, SearchAxis], judge: Judge, progress: Progress) -> None:
        self.axes, self._judge, self._progress = axes, judge, progress
        self.best: tuple[float, dict[str, float]] = (math.inf, {})
        self.evaluations = 0
        self.low = np.array([axis.low for axis in axes.values()])
        self.high = np.array([axis.high for axis in axes.values()])

    def __call__(self, places: FloatArray) -> Merit:
        return self.at(self.values(places))

    def values(self, places: FloatArray) -> dict[str, float]:
        """Return the values that belong to places on the axes."""
        named = zip(self.axes.items(), places.tolist(), strict=True)
        return {name: axis.value(place) for (name, axis), place in named}

    def at(self, values: dict[str, float]) -> Merit:
        merit = self._judge(values)
        self.evaluations += 1
        if merit.figure < self.best[0]:
            self.best = merit.figure, values
        self._progress(*self.best)
        return merit

    def figure(self, places: FloatArray) -> float:
        """Return the figure at places, infinite where it diverges."""
        return _finite(self(places))

    def roughly(self, rough: Judge, places: FloatArray) -> float:
        """Return the figure of another judge at places; it does not count among the best."""
        figure = _finite(rough(self.values(places)))
        self.evaluations += 1
        self._progress(*self.best)
        return figure

    def places(self, values: Mapping[str, float]) -> FloatArray:
        """Return where values lie on the axes, within the bounds."""
        found = np.array([axis.scaled(values[name]) for name, axis in self.axes.items()])
        inside: FloatArray = np.clip(found, self.low, self.high)
        return inside


def _finite(merit: Merit) -> float:
    return merit.figure if math.isfinite(merit.figure) else math.inf


def tunable(entry: Filter) -> dict[str, Parameter]:
    """Return the parameters of a filter that a tuner searches, by name."""
    return {each.name: each for each in entry.declared() if each.bounds.tunable}


def search(
    parameters: Mapping[str, Parameter],
    judge: Judge,
    starts: Sequence[Mapping[str, float]] = (),
    seed: int = 0,
    progress: Progress = no_progress,
    thorough: bool = False,
    rough: Judge | None = None,
) -> SearchResult:
    """Find the values that make the figure smallest.

    Points all over the bounds guard against local minima; the best of them and every start are
    refined by a few steps of least squares, and the best of those by more. Nelder-Mead around the
    best, the method of Laddach 2022, ends the search: figures have kinks that slopes do not show.
    With more than `GLOBAL_PARAMETERS` parameters, a few steps of it from the best start are all.

    Args:
        parameters: what to search, by name; none gives the figure of no change.
        judge: figure and errors for given values.
        starts: values to refine besides, such as defaults and presets.
        seed: of the points; the same seed finds the same.
        progress: called after every evaluation; what it raises ends the search.
        thorough: whether any number of parameters is searched globally.
        rough: chooses among the points all over the bounds at less cost; `judge` where None.

    Returns:
        The best values met.
    """
    run = _Search({name: SearchAxis(each) for name, each in parameters.items()}, judge, progress)
    for start in starts:
        run.at(dict(start))
    if not starts:
        run.at({name: each.default for name, each in parameters.items()})
    if thorough or len(parameters) <= GLOBAL_PARAMETERS:
        _search_everywhere(run, starts, seed, rough)
    elif run.best[1]:
        _look_around(run, np.minimum(_FEW_SIZE[0] * (run.high - run.low), _FEW_SIZE[1]), _FEW_STEPS)
    return SearchResult(run.best[1], run.best[0], run.evaluations)


def _search_everywhere(
    run: _Search, starts: Sequence[Mapping[str, float]], seed: int, rough: Judge | None
) -> None:
    size = len(run.axes)
    if not size:
        return
    figure = run.figure if rough is None else partial(run.roughly, rough)
    best = sorted(_everywhere(run, seed), key=figure)
    places = [*best[:_GLOBAL_STARTS], *map(run.places, starts)]
    begun = [descend(run, place, run.low, run.high, _FIRST_STEPS) for place in places]
    begun.sort(key=lambda each: each[0])
    for _, place in begun[:_FINALISTS]:
        descend(run, place, run.low, run.high, _STEPS)
    if run.best[1]:
        _look_around(run, np.full(size, _LAST_SIZE), _LAST_STEPS * size)


def _look_around(run: _Search, sizes: FloatArray, evaluations: int) -> None:
    """Search around the best by a simplex with edges of these sizes, (n,).

    A parameter that changes no bit of the figure is left alone: it may be one of a sensor that no
    recording has, and a larger simplex needs more evaluations.
    """
    place = run.places(run.best[1])
    inward = np.where(place + sizes > run.high, -sizes, sizes)
    usual = run.figure(place)
    felt = np.array([run.figure(corner) != usual for corner in place + np.diag(inward)])
    if not felt.any():
        return

    def figure(part: FloatArray) -> float:
        there = place.copy()
        there[felt] = part
        return run.figure(there)

    begin = place[felt]
    minimize(
        figure,
        begin,
        method="Nelder-Mead",
        bounds=list(zip(run.low[felt], run.high[felt], strict=True)),
        options={
            "initial_simplex": np.vstack([begin, begin + np.diag(inward[felt])]),
            "maxfev": evaluations,
            "xatol": _SMALL,
            "fatol": _ALIKE * run.best[0],
        },
    )


def _everywhere(run: _Search, seed: int) -> FloatArray:
    """Return random places within the bounds, (points, n)."""
    size = len(run.axes)
    places: FloatArray = np.random.default_rng(seed).uniform(
        run.low, run.high, (_POINTS * size, size)
    )
    return places
