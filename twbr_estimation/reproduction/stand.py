"""Chudzik 2021, Figs 6 to 10: both its filters, tuned and detuned, on the verification stand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..batch import run_filter
from ..drives import Drive
from ..filters import filter_named
from ..recording import FloatArray, TiltTrack
from ..robot import CorrectionSettings
from ..scoring.score import Association, Score, ScoringOptions, score
from ..simulation import simulate
from ..simulation.worlds import STAND
from ..tuning.filter import TuningTask
from ..tuning.objective import TuningSet, prepare
from ..tuning.several import Report, tune_filters
from ..workers import Workers
from .drives import TRAINING_SEEDS, Plan
from .printed import STAND_ACCELEROMETER_DEG, STAND_UNCERTAINTY_DEG

STAND_DT = 0.01
SCENES: Mapping[str, int] = {"static": 6, "vibrating": 7, "pendulum": 8, "jerking": 9}
"""Figure by scene; Fig. 10 is the detuned filters in motion."""
ACCELEROMETER = "accelerometer"
FILTERS = ("complementary", "kalman_tuned")
DETUNING: Mapping[str, float] = {"tuned": 1.0, "too fast": 0.1, "too slow": 10.0}
"""Factor on the time for which a filter follows the gyro."""
SETTLED = ScoringOptions(skip=10.0)
"""The charts of the paper begin long after its filters did."""

Estimates = dict[tuple[str, str], FloatArray]
"""Tilt [rad] by estimator and setting."""
Settings = Mapping[str, Mapping[str, float]]


def stand(
    plan: Plan, workers: Workers, report: Report, picture: Path | None = None
) -> dict[str, Any]:
    """Return the errors of both filters in every scene, tuned on all scenes of other seeds.

    Args:
        plan: how many recordings of each scene, and how long; the world is always `stand`.
        workers: who tunes.
        report: called with what improves.
        picture: file to draw the first reported recordings into.

    Raises:
        ConfigurationError: a picture is asked for and matplotlib is missing.
    """
    values = _tuned(plan, workers, report)
    if picture is not None:
        draw(picture, plan, values)
    return {
        "printed": {
            "vibrating_accelerometer_deg": STAND_ACCELEROMETER_DEG,
            "uncertainty_deg": STAND_UNCERTAINTY_DEG,
        },
        "parameters": values,
        "rows": [row for scene in SCENES for row in rows_of(scene, plan, values)],
    }


def rows_of(scene: str, plan: Plan, values: Settings) -> list[dict[str, Any]]:
    """Return the errors of every estimator and setting in one scene, over the reported seeds."""
    scored = [_scores(_recorded(scene, seed, plan), values) for seed in range(1, plan.seeds + 1)]
    return [
        {"scene": scene, "estimator": key[0], "setting": key[1]}
        | _row([each[key] for each in scored])
        for key in scored[0]
    ]


def _recorded(scene: str, seed: int, plan: Plan) -> TuningSet:
    """Return a recording as the filters of the paper get it: nothing is taken off the readings."""
    made = simulate(STAND, STAND_DT, plan.duration, seed, scene)
    setup = replace(
        made.setup,
        calibration=replace(made.setup.calibration, gyro_bias=(0.0, 0.0, 0.0)),
        correction=CorrectionSettings(euler=False, centrifugal=False, wheel=False, yaw=False),
    )
    return prepare(Drive(made.recording, setup, options=SETTLED))


def _tuned(plan: Plan, workers: Workers, report: Report) -> dict[str, dict[str, float]]:
    training = tuple(_recorded(scene, seed, plan) for seed in TRAINING_SEEDS for scene in SCENES)
    found = tune_filters(TuningTask(training), FILTERS, workers, report)
    if len(found) < len(FILTERS) or any(each.interrupted for each in found):
        raise KeyboardInterrupt  # half a comparison compares nothing
    return {each.name: dict(each.values) for each in found}


def detuned(name: str, values: Mapping[str, float], factor: float) -> dict[str, float]:
    """Return the settings with which a filter follows the gyro `factor` times as long."""
    if name == "complementary":
        return {**values, "time_constant": factor * values["time_constant"]}
    return {**values, "r": factor * factor * values["r"]}  # the gain goes with sqrt(q1 / r)


def _estimates(each: TuningSet, values: Settings) -> Estimates:
    found = {(ACCELEROMETER, ""): each.corrected.field("angle")}
    for name in FILTERS:
        entry = filter_named(name)
        for setting, factor in DETUNING.items():
            parameters = entry.configure(detuned(name, values[name], factor))
            track = run_filter(entry, parameters, each.corrected, each.setup.robot)
            found[name, setting] = track.tilt
    return found


def _scores(each: TuningSet, values: Settings) -> dict[tuple[str, str], Score]:
    stamps = each.samples.stamps
    reference = np.zeros(stamps.size)
    reference[each.known] = each.reference
    association, first = Association(TiltTrack(stamps, reference)), int(stamps[each.known][0])
    return {
        key: score(stamps, tilt, association, first)
        for key, tilt in _estimates(each, values).items()
    }


def _row(scores: list[Score]) -> dict[str, float]:
    return {
        "rmse_deg": float(np.sqrt(np.mean([each.mse_deg2 for each in scores]))),
        "bias_deg": float(np.mean([each.bias_deg for each in scores])),
        "largest_deg": max(each.max_abs_deg for each in scores),
        "delay_s": float(np.mean([each.delay_s for each in scores])),
    }


def draw(path: Path, plan: Plan, values: Settings) -> None:
    """Draw Figs 6 to 10 of the first reported recordings, one below the other."""
    from ..report.pictures import canvas, save

    settings = (("tuned", *scene) for scene in SCENES.items())
    panels = [*settings, ("too fast", "jerking", 10), ("too slow", "pendulum", 10)]
    figure, axes = canvas(len(panels), 1, (11.0, 3.0 * len(panels)))
    for (plot,), (setting, scene, number) in zip(axes, panels, strict=True):
        each = _recorded(scene, 1, plan)
        found = _estimates(each, values)
        seconds = ((each.samples.stamps - each.samples.stamps[0]) * 1e-9)[each.known]
        lines = {ACCELEROMETER: found[ACCELEROMETER, ""][each.known], "reference": each.reference}
        lines |= {name: found[name, setting][each.known] for name in FILTERS}
        shown = seconds < SETTLED.skip + 20.0
        for (label, tilt), width in zip(lines.items(), (0.4, 1.6, 0.9, 0.9), strict=True):
            plot.plot(seconds[shown], np.degrees(tilt[shown]), label=label, linewidth=width)
        plot.set_title(f"Fig. {number}: {scene}, filters {setting}", loc="left", fontsize="small")
        plot.set_ylabel("tilt [deg]")
        plot.grid(True, alpha=0.3)
        plot.margins(x=0.0)
    axes[0][0].legend(loc="upper right", ncols=4, fontsize="small")
    axes[-1][0].set_xlabel("time [s]")
    save(figure, path)
