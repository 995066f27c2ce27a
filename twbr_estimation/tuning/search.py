"""Search for the parameters that make a figure smallest: global first, then Nelder-Mead."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution, minimize

from ..filters.base import Filter, Parameter
from ..recording import FloatArray

Figure = Callable[[Mapping[str, float]], float]
Progress = Callable[[float, Mapping[str, float]], None]
"""Called after every evaluation with the best figure so far and its values; may raise to stop."""


def no_progress(best: float, values: Mapping[str, float]) -> None:
    """Take no notice of the progress of a search."""


_SMALLEST_SHARE = 1e-12  # of the default: where a logarithmic search starts from a bound of zero
_WORST = 1e12  # what a setting that diverges counts: the search goes elsewhere
_POPULATION = 8
_GENERATIONS = 25
_LOCAL_STEPS = 120  # per parameter
GLOBAL_PARAMETERS = 4
"""A filter with more parameters is searched around its starts only, unless thoroughly."""
_FEW_STEPS = 60


@dataclass(frozen=True, slots=True)
class SearchResult:
    """The best parameters met in a search."""

    values: dict[str, float]
    figure: float
    evaluations: int


class SearchAxis:
    """One parameter on the scale that is searched: logarithm, or asinh for signed gains."""

    def __init__(self, parameter: Parameter) -> None:
        """Choose the scale by the parameter's bounds and default."""
        bounds = parameter.bounds
        self._logarithmic = bounds.logarithmic
        span = max(abs(bounds.minimum), abs(bounds.maximum))
        self._unit = abs(parameter.default) or 1e-3 * span
        floor = max(_SMALLEST_SHARE * self._unit, 1e-300)
        low = max(bounds.minimum, floor) if self._logarithmic else bounds.minimum
        self.low, self.high = self.scaled(low), self.scaled(bounds.maximum)
        self._limits = bounds.minimum, bounds.maximum

    def scaled(self, value: float) -> float:
        """Return the place of a value on the searched scale."""
        if self._logarithmic:
            return math.log(max(value, 1e-300))
        return math.asinh(value / self._unit)

    def value(self, place: float) -> float:
        """Return the value at a place, within the parameter's bounds."""
        raw = math.exp(place) if self._logarithmic else self._unit * math.sinh(place)
        return min(max(raw, self._limits[0]), self._limits[1])


class _Search:
    """Counts evaluations and remembers the best."""

    def __init__(self, axes: Mapping[str, SearchAxis], figure: Figure, progress: Progress) -> None:
        self.axes, self._figure, self._progress = axes, figure, progress
        self.best: tuple[float, dict[str, float]] = (math.inf, {})
        self.evaluations = 0

    def __call__(self, places: FloatArray) -> float:
        values = {
            name: axis.value(float(place))
            for (name, axis), place in zip(self.axes.items(), places, strict=True)
        }
        return self.at(values)

    def at(self, values: dict[str, float]) -> float:
        figure = self._figure(values)
        self.evaluations += 1
        if figure < self.best[0]:
            self.best = figure, values
        self._progress(*self.best)
        return figure if math.isfinite(figure) else _WORST


def tunable(entry: Filter) -> dict[str, Parameter]:
    """Return the parameters of a filter that a tuner searches, by name."""
    return {each.name: each for each in entry.declared() if each.bounds.tunable}


def search(
    parameters: Mapping[str, Parameter],
    figure: Figure,
    starts: Sequence[Mapping[str, float]] = (),
    seed: int = 0,
    progress: Progress = no_progress,
    thorough: bool = False,
) -> SearchResult:
    """Find the values that make `figure` smallest.

    Differential evolution covers the bounds against local minima; Nelder-Mead, the method
    of Laddach 2022, then refines its result and every start, and the best of all counts. With
    more than `GLOBAL_PARAMETERS` parameters, Nelder-Mead takes a few steps from the best start.

    Args:
        parameters: what to search, by name; none gives the figure of no change.
        figure: the figure for given values.
        starts: values to refine besides, such as defaults and presets.
        seed: of the global search; the same seed finds the same.
        progress: called after every evaluation; what it raises ends the search.
        thorough: whether any number of parameters is searched globally.

    Returns:
        The best values met.
    """
    run = _Search({name: SearchAxis(each) for name, each in parameters.items()}, figure, progress)
    for start in starts:
        run.at(dict(start))
    if not starts:
        run.at({name: each.default for name, each in parameters.items()})
    if thorough or len(parameters) <= GLOBAL_PARAMETERS:
        _search_everywhere(run, starts, seed)
    elif run.best[1]:
        _refine(run, run.best[1], _FEW_STEPS)
    return SearchResult(run.best[1], run.best[0], run.evaluations)


def _search_everywhere(run: _Search, starts: Sequence[Mapping[str, float]], seed: int) -> None:
    if not run.axes:
        return
    _evolve(run, seed)
    for start in [run.best[1], *starts] if run.best[1] else starts:
        _refine(run, start, _LOCAL_STEPS * len(run.axes))


def _evolve(run: _Search, seed: int) -> None:
    differential_evolution(
        run,
        [(axis.low, axis.high) for axis in run.axes.values()],
        popsize=_POPULATION,
        maxiter=_GENERATIONS,
        polish=False,
        seed=seed,
        init="sobol",
    )


def _refine(run: _Search, start: Mapping[str, float], steps: int) -> None:
    axes = run.axes
    places = np.array(
        [min(max(axis.scaled(start[name]), axis.low), axis.high) for name, axis in axes.items()]
    )
    minimize(
        run,
        places,
        method="Nelder-Mead",
        bounds=[(axis.low, axis.high) for axis in axes.values()],
        options={
            "maxfev": steps,
            "xatol": 1e-4,
            "fatol": 1e-6,
            "adaptive": True,
            "initial_simplex": _simplex(places, list(axes.values())),
        },
    )


def _simplex(places: FloatArray, axes: Sequence[SearchAxis]) -> FloatArray:
    """Return a first simplex with steps of a tenth of each scale, turned inward at bounds."""
    corners = np.tile(places, (places.size + 1, 1))
    for index, axis in enumerate(axes):
        step = min(0.1 * (axis.high - axis.low), 0.7)
        inward = -step if places[index] + step > axis.high else step
        corners[index + 1, index] += inward
    return corners
