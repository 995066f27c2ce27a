"""Tune one filter: Laddach 2022, Table 2."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np

from ..batch import run_filter
from ..filters.base import Filter, Parameter, filter_named
from ..recording import FloatArray
from .merit import USELESS, Merit, merit_of
from .objective import Objective, TuningSet
from .search import Judge, Progress, no_progress, search, tunable
from .warnings import error_moduli, warnings_for

FORGET_WITHIN = 60.0
"""Time within which a tilt error must shrink to 1/e [s]: a recording that begins with the right
tilt, as most do, would not miss it."""


@dataclass(frozen=True, slots=True)
class TunedFilter:
    """Result of tuning one filter."""

    name: str
    values: Mapping[str, float]
    """Every parameter, tuned or left alone."""
    training_mse_deg2: float
    """Mean over the training recordings [deg^2]."""
    verification_mse_deg2: float | None
    """Mean over the verification recordings [deg^2]; None where there are none."""
    eigenvalue_moduli: tuple[float, ...]
    """Of A - KCA, eq. (25), largest first; empty for a filter without matrices."""
    warnings: tuple[str, ...]
    interrupted: bool = False

    @staticmethod
    def of(data: Mapping[str, Any]) -> TunedFilter:
        """Return the result whose fields are these, lists in place of tuples."""
        moduli, warnings = tuple(data["eigenvalue_moduli"]), tuple(data["warnings"])
        return TunedFilter(**{**data, "eigenvalue_moduli": moduli, "warnings": warnings})

    @property
    def judged_mse_deg2(self) -> float:
        """The verification MSE, or the training MSE where nothing was verified [deg^2]."""
        if self.verification_mse_deg2 is None:
            return self.training_mse_deg2
        return self.verification_mse_deg2


@dataclass(frozen=True, slots=True)
class TuningTask:
    """The part of a tuning that all filters share; it is sent to other processes."""

    training: tuple[TuningSet, ...]
    verification: tuple[TuningSet, ...] = ()
    objective: Objective = field(default_factory=Objective)
    starts: Mapping[str, Sequence[Mapping[str, float]]] = field(default_factory=dict)
    """Values to start from besides the defaults by filter name, such as a preset's."""
    seed: int = 0
    """Of the global search."""
    thorough: bool = False
    """Whether filters of many parameters are searched globally, too."""


def tune_filter(task: TuningTask, name: str, progress: Progress = no_progress) -> TunedFilter:
    """Find the parameters with which a filter does best on the training recordings.

    Args:
        task: recordings and objective.
        name: of the filter.
        progress: called with the best figure so far; what it raises ends the search.

    Raises:
        ConfigurationError: there is no such filter.
    """
    entry = filter_named(name)
    parameters = tunable(entry)
    defaults = {each.name: each.default for each in parameters.values()}
    starts = [defaults, *({**defaults, **_only(s, parameters)} for s in task.starts.get(name, ()))]
    judge = _judge(entry, task)
    part = replace(task, training=tuple(each.beginning for each in task.training))
    rough = _judge(entry, part)
    found = search(parameters, judge, starts, task.seed, progress, task.thorough, rough)
    return judged(task, name, found.values, judge=judge)


def judged(
    task: TuningTask,
    name: str,
    values: Mapping[str, float],
    interrupted: bool = False,
    judge: Judge | None = None,
) -> TunedFilter:
    """Return the figures and warnings of a filter with the values that a search found.

    `judge`, where given, is what the search asked; it remembers.
    """
    entry = filter_named(name)
    values = entry.configure(values)._asdict()
    training = mean_square_error(entry, values, task.training)
    verified = mean_square_error(entry, values, task.verification) if task.verification else None
    dt, asked = task.training[0].dt, judge or _judge(entry, task)
    return TunedFilter(
        name,
        values,
        training,
        verified,
        error_moduli(entry, values, dt),
        warnings_for(entry, values, dt, training, verified, lambda each: asked(each).figure),
        interrupted,
    )


def mean_square_error(
    entry: Filter, values: Mapping[str, float], sets: Sequence[TuningSet]
) -> float:
    """Return the MSE of a filter, averaged over recordings [deg^2]."""
    return _merit(entry, entry.configure(values), sets, Objective()).figure


def _judge(entry: Filter, task: TuningTask) -> Judge:
    @cache
    def judged_before(parameters: Any) -> Merit:  # searches come back to the best, and warnings do
        if not _forgets(entry, parameters, task.training[0].dt):
            return USELESS
        return _merit(entry, parameters, task.training, task.objective)

    return lambda values: judged_before(entry.configure(values))


def _forgets(entry: Filter, parameters: Any, dt: float) -> bool:
    """Return whether a tilt error dies out by the error dynamics A - KCA of (25)."""
    if entry.matrices is None:
        return True
    a, _, c, k = entry.matrices(parameters, dt)
    with np.errstate(over="ignore", invalid="ignore"):
        later = np.linalg.matrix_power(a - k @ c @ a, round(FORGET_WITHIN / dt))
    return bool(abs(later[0, 0]) < math.exp(-1.0))


def _merit(
    entry: Filter, parameters: Any, sets: Sequence[TuningSet], objective: Objective
) -> Merit:
    def tilt_of(each: TuningSet) -> FloatArray:
        return run_filter(entry, parameters, each.corrected, each.setup.robot).tilt

    return merit_of(sets, tilt_of, objective)


def _only(start: Mapping[str, float], parameters: Mapping[str, Parameter]) -> dict[str, float]:
    return {name: value for name, value in start.items() if name in parameters}
