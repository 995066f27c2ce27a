"""Tune the correction's low-pass filters, then the filters, on recordings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..batch import correct, run_filter
from ..bounds import Bounds
from ..errors import ConfigurationError
from ..filters.base import Filter, Parameter
from ..recording import FloatArray
from ..robot import CorrectionSettings, Setup
from .objective import Objective, TuningSet
from .search import Figure, Found, Progress, search, tunable

LARGEST_TIME_CONSTANT = 1.0
"""Upper bound of the low-pass time constants in a search [s]."""
LARGEST_MODULUS = 1.0 + 1e-6
"""Settings with an eigenvalue (25) beyond it are left out of the search: they diverge."""
OVER_FIT = 2.0
"""A verification figure this many times the training figure is called over-fit."""
SATURATED = 0.001
"""A larger share of saturated samples makes gains carry what saturation hides."""
_INSENSITIVE = 1e-3  # relative change of the figure when a parameter is halved and doubled


@dataclass(frozen=True, slots=True)
class TunedFilter:
    """What tuning found for one filter."""

    name: str
    values: Mapping[str, float]
    """Every parameter, tuned or left alone."""
    training_mse_deg2: float
    verification_mse_deg2: float | None
    eigenvalues: tuple[float, ...]
    """Moduli of the eigenvalues of A - KCA, eq. (25), largest first; empty without matrices."""
    warnings: tuple[str, ...]
    evaluations: int
    interrupted: bool = False


@dataclass(frozen=True, slots=True)
class TunedCorrection:
    """What tuning found for the low-pass filters (16) and (19)."""

    settings: CorrectionSettings
    mse_before_deg2: float
    """MSE of the angle without any correction of motion, as in Table 1 [deg^2]."""
    mse_after_deg2: float
    """MSE of the corrected angle [deg^2]."""
    evaluations: int


def tune_correction(
    sets: Sequence[TuningSet], setup: Setup, seed: int = 0, progress: Progress = lambda best: None
) -> TunedCorrection:
    """Find the time constants that make the corrected angle best (Laddach 2022, Table 1).

    Args:
        sets: training recordings.
        setup: robot and calibration; its correction settings are the start.
        seed: of the global search.
        progress: called with the best MSE so far [deg^2].
    """
    names = ("rate_time_constant", "velocity_time_constant")
    base = setup.correction
    bounds = Bounds(0.0, LARGEST_TIME_CONSTANT, "s", "low-pass time constant")
    start = {name: max(getattr(base, name), 0.0) for name in names}
    parameters = {name: Parameter(name, start[name] or 0.02, bounds) for name in names}

    def mse(settings: CorrectionSettings) -> float:
        changed = replace(setup, correction=settings)
        angles = (correct(each.samples, changed).field("angle") for each in sets)
        return _mean_square([each.errors(angle) for each, angle in zip(sets, angles, strict=True)])

    def smoothed(values: Mapping[str, float]) -> CorrectionSettings:
        rate, velocity = (values[name] for name in names)
        return replace(base, rate_time_constant=rate, velocity_time_constant=velocity)

    def figure(values: Mapping[str, float]) -> float:
        return mse(smoothed(values))

    found = search(parameters, figure, [start], seed, progress)
    off = replace(base, euler=False, centrifugal=False, wheel=False)
    dt = float(np.mean([each.dt for each in sets]))
    settings = replace(smoothed(found.values), dt=dt)
    return TunedCorrection(settings, mse(off), found.figure, found.evaluations)


def tune_filter(
    entry: Filter,
    training: Sequence[TuningSet],
    verification: Sequence[TuningSet] = (),
    objective: Objective | None = None,
    starts: Sequence[Mapping[str, float]] = (),
    seed: int = 0,
    progress: Progress = lambda best: None,
) -> TunedFilter:
    """Find the parameters with which a filter does best on the training recordings.

    Args:
        entry: the filter.
        training: recordings to tune on; the figures are averaged.
        verification: other recordings, for the verification MSE.
        objective: what to make small; MSE by default.
        starts: values to start from besides the defaults, such as a preset's.
        seed: of the global search.
        progress: called with the best figure so far.
    """
    objective = objective or Objective()
    parameters = tunable(entry)
    defaults = {name: each.default for name, each in parameters.items()}
    given = [{**defaults, **_only(start, parameters)} for start in starts]
    figure = _figure(entry, training, objective)
    found = search(parameters, figure, [defaults, *given], seed, progress)
    values = entry.configure(found.values)._asdict()
    training_mse = mean_square_error(entry, values, training)
    verified = mean_square_error(entry, values, verification) if verification else None
    moduli = _moduli(entry, values, training[0].dt)
    return TunedFilter(
        entry.name,
        values,
        training_mse,
        verified,
        moduli,
        _warnings(entry, found, figure, training, training_mse, verified),
        found.evaluations,
        found.interrupted,
    )


def mean_square_error(
    entry: Filter, values: Mapping[str, float], sets: Sequence[TuningSet]
) -> float:
    """Return the MSE of a filter, averaged over recordings [deg^2]."""
    return _figure(entry, sets, Objective())(values)


def _figure(entry: Filter, sets: Sequence[TuningSet], objective: Objective) -> Figure:
    def figure(values: Mapping[str, float]) -> float:
        parameters = entry.configure(values)
        if _diverges(entry, parameters, sets[0].dt):
            return math.inf
        figures = []
        for each in sets:
            tilt = run_filter(entry, parameters, each.corrected, each.robot).tilt
            figures.append(objective.value(each.errors(tilt), each.slope, each.dt))
        return float(np.mean(figures))

    return figure


def _diverges(entry: Filter, parameters: Any, dt: float) -> bool:
    """Return whether an error grows, however little: a short recording would not show it."""
    if entry.matrices is None:
        return False
    moduli = np.abs(entry.matrices(parameters, dt).error_eigenvalues())
    return bool(moduli.max() > LARGEST_MODULUS)


def _mean_square(errors: Sequence[FloatArray]) -> float:
    return float(np.mean([np.mean(np.square(np.degrees(each))) for each in errors]))


def _only(start: Mapping[str, float], parameters: Mapping[str, Parameter]) -> dict[str, float]:
    return {name: value for name, value in start.items() if name in parameters}


def _moduli(entry: Filter, values: Mapping[str, float], dt: float) -> tuple[float, ...]:
    if entry.matrices is None:
        return ()
    eigenvalues = entry.matrices(entry.configure(values), dt).error_eigenvalues()
    return tuple(sorted((float(abs(each)) for each in eigenvalues), reverse=True))


def _warnings(
    entry: Filter,
    found: Found,
    figure: Figure,
    training: Sequence[TuningSet],
    training_mse: float,
    verification_mse: float | None,
) -> tuple[str, ...]:
    warnings = list(entry.warnings(entry.configure(found.values), training[0].dt))
    if verification_mse is not None and verification_mse > OVER_FIT * training_mse:
        warnings.append(
            f"{entry.name}: verification {verification_mse:.3g} deg^2 is more than {OVER_FIT:g} "
            f"times training {training_mse:.3g}: over-fit, or recordings of another kind"
        )
    for name in _not_identifiable(found, figure):
        warnings.append(f"{entry.name}.{name}: the recordings do not determine it")
    for each in training:
        if each.saturated > SATURATED:
            warnings.append(
                f"{each.source}: {100 * each.saturated:.2f} % of the samples are saturated; "
                "the gains carry what saturation hides"
            )
    return tuple(warnings)


def _not_identifiable(found: Found, figure: Figure) -> list[str]:
    """Return the parameters that may be halved and doubled without a change of the figure."""
    flat = []
    for name, value in found.values.items():
        changes = []
        for factor in (0.5, 2.0):
            try:
                changed = figure({**found.values, name: factor * value})
            except ConfigurationError:  # beyond the bounds there is nothing to learn
                continue
            changes.append(abs(changed - found.figure))
        if changes and max(changes) < _INSENSITIVE * found.figure:
            flat.append(name)
    return flat
