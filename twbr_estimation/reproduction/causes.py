"""Why figures differ from the printed ones: each cause switched on and off on the rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..filters import filter_named
from ..simulation import World
from ..tuning.filter import mean_square_error
from ..tuning.objective import TuningSet
from ..tuning.several import Report
from ..workers import Workers
from .drives import Plan
from .printed import PERIODS
from .tables import printed_settings, tuned_filters

GYRO_SCALES = (0.0, -0.025, -0.055)
"""Gyro scale errors for which theta is tuned."""
SATURATION_SEEDS = 20
"""Drives with which saturation is judged: few hold a long one."""


def causes(plan: Plan, workers: Workers, report: Report) -> dict[str, Any]:
    """Return figures for the causes that the page names."""
    return {
        "kalman_process_noise": [_process_noise(plan, dt) for dt in PERIODS],
        "saturation": _saturation(plan),
        "gyro_gain": [_gyro_gain(plan, scale, workers, report) for scale in GYRO_SCALES],
    }


def _process_noise(plan: Plan, dt: float) -> dict[str, float]:
    """Return the MSE of the row "Kalman" with q1 dt as printed, and with q1 dt^2."""
    sets, values = plan.reported(dt), printed_settings(dt)[1]
    figures = {
        name: mean_square_error(filter_named(name), values[name], sets)
        for name in ("kalman_printed", "kalman")
    }
    return {"dt": dt, "q1_dt_deg2": figures["kalman_printed"], "q1_dt2_deg2": figures["kalman"]}


def _saturation(plan: Plan) -> list[dict[str, float]]:
    """Return the MSE with the printed gains of 2 and 10 ms, with and without full scales."""
    many = replace(plan, seeds=SATURATION_SEEDS)
    rows = []
    for dt in (0.002, 0.01):
        values = printed_settings(dt)[1]["complementary"]
        sets = many.reported(dt)
        limited = _each(values, sets)
        unlimited = _each(values, replace(many, world=_analogue(plan.world)).reported(dt))
        rows.append(
            {
                "dt": dt,
                "time_constant": values["time_constant"],
                "drives": SATURATION_SEEDS,
                "limited_deg2": float(np.mean(limited)),
                "limited_worst_deg2": max(limited),
                "unlimited_deg2": float(np.mean(unlimited)),
                "unlimited_worst_deg2": max(unlimited),
                "saturated_share": float(np.mean([each.saturated for each in sets])),
            }
        )
    return rows


def _each(values: Mapping[str, float], sets: Sequence[TuningSet]) -> list[float]:
    """Return the complementary filter's MSE of each drive [deg^2]."""
    entry = filter_named("complementary")
    return [mean_square_error(entry, values, [each]) for each in sets]


def _analogue(world: World) -> World:
    """Return the same world with sensors and encoders that neither saturate nor round."""
    return replace(world, digital=False)


def _gyro_gain(plan: Plan, scale: float, workers: Workers, report: Report) -> dict[str, float]:
    """Return the tuned theta, a gain on the gyro, for a gyro that reads so much low."""
    changed = replace(plan, world=replace(plan.world, gyro_scale_error=scale))
    name = "alpha_beta_theta_gamma"
    (tuned,) = tuned_filters(
        changed, PERIODS[0], [name], changed.reported(PERIODS[0]), workers, report
    )
    return {
        "gyro_scale_error": scale,
        "undone_by": 1.0 / (1.0 + scale),
        "theta": tuned.values["theta"],
        "verification_deg2": float(tuned.judged_mse_deg2),
    }
