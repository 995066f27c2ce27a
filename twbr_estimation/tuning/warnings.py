"""Warnings about tuned parameters: limits reached, too little motion and the like."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ..checks.readings import NOTEWORTHY_SATURATION
from ..errors import ConfigurationError
from ..filters.base import Filter
from .objective import TuningSet
from .search import tunable

Figure = Callable[[Mapping[str, float]], float]

OVER_FIT = 2.0
"""A verification figure this many times the training figure is called over-fit."""
_INSENSITIVE = 1e-3  # relative change of the figure when a parameter is halved and doubled


def error_moduli(entry: Filter, values: Mapping[str, float], dt: float) -> tuple[float, ...]:
    """Return the moduli of the eigenvalues of A - KCA, eq. (25), largest first."""
    if entry.matrices is None:
        return ()
    eigenvalues = entry.matrices(entry.configure(values), dt).error_eigenvalues()
    return tuple(sorted((float(abs(each)) for each in eigenvalues), reverse=True))


def warnings_for(
    entry: Filter,
    values: Mapping[str, float],
    dt: float,
    training_mse: float,
    verification_mse: float | None,
    figure: Figure,
) -> tuple[str, ...]:
    """Return the warnings that concern one filter.

    Args:
        entry: the filter.
        values: all its parameters.
        dt: sampling period [s].
        training_mse: with these values [deg^2].
        verification_mse: with these values [deg^2]; None where nothing was verified.
        figure: what the search made small.
    """
    warnings = list(entry.warnings(entry.configure(values), dt))
    if verification_mse is not None and not verification_mse <= OVER_FIT * training_mse:
        warnings.append(
            f"{entry.name}: verification {verification_mse:.3g} deg^2 is more than {OVER_FIT:g} "
            f"times training {training_mse:.3g} deg^2: over-fit, or recordings of another kind"
        )
    for name in _undetermined(entry, values, figure):
        warnings.append(f"{entry.name}.{name}: halved or doubled, it changes next to nothing")
    for name in _scales(entry, values, figure):
        warnings.append(
            f"{entry.name}.{name}: not identifiable; only its ratio to the other variances "
            "matters, so it was left alone"
        )
    return tuple(warnings)


def saturation_warnings(sets: Sequence[TuningSet]) -> tuple[str, ...]:
    """Return a warning for each recording with noteworthy saturation."""
    return tuple(
        f"{each.source}: {100 * each.saturated:.2f} % of the samples are saturated; "
        "gains carry what saturation hides"
        for each in sets
        if each.saturated > NOTEWORTHY_SATURATION
    )


def _undetermined(entry: Filter, values: Mapping[str, float], figure: Figure) -> list[str]:
    """Return the tuned parameters that may be halved and doubled at no price."""
    usual = figure(values)
    return [
        name
        for name in tunable(entry)
        if values[name] != 0.0 and _is_flat(name, values, figure, usual)
    ]


def _is_flat(name: str, values: Mapping[str, float], figure: Figure, usual: float) -> bool:
    """Return whether halving and doubling a value, where allowed, leaves the figure as it is."""
    allowed = False
    for factor in (0.5, 2.0):
        try:
            changed = figure({**values, name: factor * values[name]})
        except ConfigurationError:  # beyond the bounds there is nothing to learn
            continue
        if not abs(changed - usual) < _INSENSITIVE * usual:
            return False
        allowed = True
    return allowed


def _scales(entry: Filter, values: Mapping[str, float], figure: Figure) -> list[str]:
    """Return an untuned variance that, scaled with the tuned ones, changes nothing."""
    variances = [name for name in tunable(entry) if name.startswith("q")]
    if "r" not in values or "r" in tunable(entry) or not variances:
        return []
    scaled = {name: 2.0 * values[name] for name in [*variances, "r"]}
    try:
        changed = figure({**values, **scaled})
    except ConfigurationError:
        return []
    return ["r"] if abs(changed - figure(values)) < _INSENSITIVE * figure(values) else []
