"""Tables 1 and 2: time constants and filter parameters, printed and tuned on the rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from ..configuration.presets import preset
from ..errors import ConfigurationError
from ..filters import filter_named
from ..filters.base import Filter
from ..robot import CorrectionSettings
from ..tuning.correction import corrected_mse, tune_correction
from ..tuning.filter import TunedFilter, TuningTask, mean_square_error
from ..tuning.objective import TuningSet
from ..tuning.search import tunable
from ..tuning.several import Report, tune_filters
from ..workers import Workers
from .drives import Plan, raw_mse
from .printed import CORRECTED_MSE, PERIODS, RAW_MSE, ROWS, UNPRINTED

Row = dict[str, Any]


def printed_settings(dt: float) -> tuple[CorrectionSettings, Mapping[str, Mapping[str, float]]]:
    """Return Table 1's and Table 2's values for a sampling period."""
    correction, settings = preset("table2", dt)
    if correction is None:
        raise ConfigurationError("preset table2 holds no time constants")
    return correction, settings.values


def table1(plan: Plan, report: Report) -> list[Row]:
    """Return the rows of Table 1: time constants, and the angle's MSE before and after."""
    rows = []
    for dt, before, after in zip(PERIODS, RAW_MSE, CORRECTED_MSE, strict=True):
        printed, _ = printed_settings(dt)
        progress = partial(report, _at("Table 1", dt))
        tuned = tune_correction(plan.training(dt), progress=progress).settings
        sets = plan.reported(dt)
        rows.append(
            {
                "dt": dt,
                "printed": {"before_deg2": before, "after_deg2": after, **_constants(printed)},
                "rig": {
                    "before_deg2": raw_mse(sets),
                    "after_deg2": corrected_mse(sets, tuned),
                    "after_with_printed_deg2": corrected_mse(sets, printed),
                    **_constants(tuned),
                },
            }
        )
    return rows


def table2(plan: Plan, workers: Workers, report: Report) -> list[Row]:
    """Return the rows of Table 2, a filter and a period each.

    Each filter runs on the reported drives twice: with the printed parameters behind a
    correction with Table 1's time constants, and tuned behind a tuned correction.
    """
    rows = []
    for column, dt in enumerate(PERIODS):
        reported = plan.reported(dt)
        tuned = tuned_filters(plan, dt, [*ROWS, *UNPRINTED], reported, workers, report)
        _, values = printed_settings(dt)
        for each in tuned:
            entry = filter_named(each.name)
            untuned = mean_square_error(entry, values[each.name], reported)
            rig = {**_figures(each), "with_printed_deg2": untuned}
            row: Row = {"dt": dt, "filter": each.name, "rig": rig}
            if each.name in ROWS:
                training, verification = ROWS[each.name][column]
                row["printed"] = {
                    "training_deg2": training,
                    "verification_deg2": verification,
                    "parameters": _searched(entry, values[each.name]),
                }
            rows.append(row)
    return rows


def tuned_filters(
    plan: Plan,
    dt: float,
    names: Sequence[str],
    reported: Sequence[TuningSet],
    workers: Workers,
    report: Report,
) -> list[TunedFilter]:
    """Tune filters on the training drives and judge them on the reported ones."""
    training = plan.training(dt)
    settings = tune_correction(training).settings
    task = TuningTask(
        tuple(each.corrected_with(settings) for each in training),
        tuple(each.corrected_with(settings) for each in reported),
        starts={name: [values] for name, values in printed_settings(dt)[1].items()},
    )

    def at_this_period(name: str, best: float, values: Mapping[str, float]) -> None:
        report(_at(name, dt), best, values)

    tuned = tune_filters(task, names, workers, at_this_period)
    if len(tuned) < len(names) or any(each.interrupted for each in tuned):
        raise KeyboardInterrupt  # half a table is of no use
    return tuned


def _at(name: str, dt: float) -> str:
    return f"{name} at {1e3 * dt:g} ms"


def _constants(settings: CorrectionSettings) -> Row:
    return {name: getattr(settings, name) for name in _CONSTANTS}


_CONSTANTS = ("rate_time_constant", "velocity_time_constant")


def _figures(tuned: TunedFilter) -> Row:
    entry = filter_named(tuned.name)
    return {
        "training_deg2": tuned.training_mse_deg2,
        "verification_deg2": tuned.verification_mse_deg2,
        "largest_modulus": max(tuned.eigenvalue_moduli, default=None),
        "parameters": _searched(entry, tuned.values),
    }


def _searched(entry: Filter, values: Mapping[str, float]) -> dict[str, float]:
    return {name: values[name] for name in tunable(entry) if name in values}
