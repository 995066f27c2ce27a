"""Search for the parameters that make a figure smallest: points everywhere, then least squares.

The figure is a mean of squares, and whoever judges a setting shows the errors behind it as well, so
that a few settings near one say where a better one lies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ..filters.base import Filter, Parameter
from ..recording import FloatArray
from .axis import SearchAxis
from .descent import Descent
from .merit import Merit

Judge = Callable[[Mapping[str, float]], Merit]
Progress = Callable[[float, Mapping[str, float]], None]
"""Called after every evaluation with the best figure so far and its values; may raise to stop."""


def no_progress(best: float, values: Mapping[str, float]) -> None:
    """Take no notice of the progress of a search."""


_POINTS = 24  # per parameter: all over the bounds, then in boxes around the best, each smaller
_BOXES = (1.0, 0.4, 0.12)  # of the bounds
_GLOBAL_STARTS = 3  # points that are refined beside the given starts
_FIRST_STEPS = 5  # from each start, per parameter; then the best of them go on
_FINALISTS = 2
_STEPS = 15  # of those, per parameter
_LAST_STEPS = 30  # of the simplex around the best, per parameter
_LAST_SIZE = 0.3
GLOBAL_PARAMETERS = 4
"""A filter with more parameters is searched around its starts only, unless thoroughly."""
_FEW_STEPS = 40  # of the simplex; what fits one minute better by more steps fits others worse
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
        return self.at(
            {
                name: axis.value(place)
                for (name, axis), place in zip(self.axes.items(), places.tolist(), strict=True)
            }
        )

    def at(self, values: dict[str, float]) -> Merit:
        merit = self._judge(values)
        self.evaluations += 1
        if merit.figure < self.best[0]:
            self.best = merit.figure, values
        self._progress(*self.best)
        return merit

    def figure(self, places: FloatArray) -> float:
        """Return the figure at places, infinite where it diverges."""
        figure = self(places).figure
        return figure if math.isfinite(figure) else math.inf

    def places(self, values: Mapping[str, float]) -> FloatArray:
        """Return where values lie on the axes, within the bounds."""
        found = np.array([axis.scaled(values[name]) for name, axis in self.axes.items()])
        inside: FloatArray = np.clip(found, self.low, self.high)
        return inside


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
) -> SearchResult:
    """Find the values that make the figure smallest.

    Points all over the bounds guard against local minima; the best of them and every start are
    refined by a few steps of least squares, and the best of those by more. A simplex of Nelder and
    Mead around the best ends the search, as figures have kinks that slopes do not show. With more
    than `GLOBAL_PARAMETERS` parameters, a few steps of the simplex from the best start are all.

    Args:
        parameters: what to search, by name; none gives the figure of no change.
        judge: figure and errors for given values.
        starts: values to refine besides, such as defaults and presets.
        seed: of the points; the same seed finds the same.
        progress: called after every evaluation; what it raises ends the search.
        thorough: whether any number of parameters is searched globally.

    Returns:
        The best values met.
    """
    run = _Search({name: SearchAxis(each) for name, each in parameters.items()}, judge, progress)
    for start in starts:
        run.at(dict(start))
    if not starts:
        run.at({name: each.default for name, each in parameters.items()})
    if thorough or len(parameters) <= GLOBAL_PARAMETERS:
        _search_everywhere(run, starts, seed)
    elif run.best[1]:
        _look_around(run, np.minimum(_FEW_SIZE[0] * (run.high - run.low), _FEW_SIZE[1]), _FEW_STEPS)
    return SearchResult(run.best[1], run.best[0], run.evaluations)


def _search_everywhere(run: _Search, starts: Sequence[Mapping[str, float]], seed: int) -> None:
    size = len(run.axes)
    if not size:
        return
    found = _everywhere(run, seed)
    places = [*(place for _, place in found[:_GLOBAL_STARTS]), *map(run.places, starts)]
    begun = [Descent(run, place, run.low, run.high) for place in places]
    for each in begun:
        each.go_on(_FIRST_STEPS * size)
    begun.sort(key=lambda each: each.figure)
    for each in begun[:_FINALISTS]:
        each.go_on(_STEPS * size)
    if run.best[1]:
        _look_around(run, np.full(size, _LAST_SIZE), _LAST_STEPS * size)


def _look_around(run: _Search, sizes: FloatArray, evaluations: int) -> None:
    """Search around the best by a simplex with edges of these sizes, (n,)."""
    place = run.places(run.best[1])
    inward = np.where(place + sizes > run.high, -sizes, sizes)
    minimize(
        run.figure,
        place,
        method="Nelder-Mead",
        bounds=list(zip(run.low, run.high, strict=True)),
        options={
            "initial_simplex": np.vstack([place, place + np.diag(inward)]),
            "maxfev": evaluations,
            "xatol": _SMALL,
            "fatol": _ALIKE * run.best[0],
        },
    )


def _everywhere(run: _Search, seed: int) -> list[tuple[float, FloatArray]]:
    """Return figures and places all over the bounds, and around the best of them; best first."""
    random, size = np.random.default_rng(seed), len(run.axes)
    found: list[tuple[float, FloatArray]] = []
    for share in _BOXES:
        half = 0.5 * share * (run.high - run.low)
        middle = found[0][1] if found else run.low + half
        low = np.clip(middle - half, run.low, run.high - 2.0 * half)
        places = low + 2.0 * half * spread_evenly(_POINTS * size, random.random(size))
        found += [(run.figure(place), place) for place in places]
        found.sort(key=lambda each: each[0])
    return found


def spread_evenly(count: int, first: FloatArray) -> FloatArray:
    """Return points that fill the unit cube evenly, (count, n), after a first one, (n,).

    Multiples of powers of the generalised golden ratio, modulo 1 (Roberts 2018).
    """
    size = first.size
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (size + 1.0))
    shares: FloatArray = (
        first + np.outer(np.arange(count), ratio ** -np.arange(1.0, size + 1.0))
    ) % 1.0
    return shares
