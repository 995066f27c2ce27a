"""Tune the filters of the papers for each world and period, and set `ins_odometer` beside them.

    python bench/accuracy_tuned.py

Every filter is tuned on recordings of other seeds, once behind the correction's published time
constants and once behind tuned ones, and judged by training; the table holds the best filter of
each cell, its mean square error on the verification seeds [deg^2] and how many times that is the
error of `ins_odometer` with its defaults. With `--filter ins_odometer` it says what tuning gains.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from twbr_estimation.configuration.presets import preset
from twbr_estimation.filters import filter_named
from twbr_estimation.simulation import simulate
from twbr_estimation.tuning.correction import tune_correction
from twbr_estimation.tuning.filter import TunedFilter, TuningTask, mean_square_error, tune_filter
from twbr_estimation.tuning.objective import TuningSet, prepare

PAPERS = ("complementary", "kalman", "alpha_beta_wob", "alpha_beta_wb", "alpha_beta_theta_wa_b")
TRAINING = range(101, 106)
VERIFICATION = (range(2000, 2010), range(3001, 3011))
OURS = "ins_odometer"


def recordings(world: str, dt: float, seeds: Iterable[int]) -> tuple[TuningSet, ...]:
    """Return simulated recordings, corrected, with their reference."""
    made = (simulate(world, dt, 60.0, seed) for seed in seeds)
    return tuple(prepare(each.drive) for each in made)


def best_tuned(
    training: tuple[TuningSet, ...], names: Iterable[str], dt: float
) -> tuple[TunedFilter, tuple[TuningSet, ...]]:
    """Return the filter that does best in training, and the recordings it was tuned on."""
    tuned = tune_correction(training).settings
    found: list[tuple[TunedFilter, tuple[TuningSet, ...]]] = []
    _, printed = preset("table2", dt)
    starts = {name: [values] for name, values in printed.values.items()}
    for sets in (training, tuple(each.corrected_with(tuned) for each in training)):
        task = TuningTask(sets, starts=starts)
        found += [(tune_filter(task, name), sets) for name in names]
    return min(found, key=lambda pair: pair[0].training_mse_deg2)


def row(world: str, dt: float, names: Iterable[str]) -> str:
    """Return one cell of the comparison as a table's row."""
    tuned, sets = best_tuned(recordings(world, dt, TRAINING), names, dt)
    own, theirs = filter_named(OURS), filter_named(tuned.name)
    cells = [world, f"{dt * 1e3:g} ms", tuned.name]
    for seeds in VERIFICATION:
        held = recordings(world, dt, seeds)
        mine = mean_square_error(own, {}, held)
        settings = sets[0].setup.correction
        corrected = [each.corrected_with(settings) for each in held]
        other = mean_square_error(theirs, tuned.values, corrected)
        cells += [f"{other:.3f}", f"{mine:.3f}", f"{other / mine:.1f}"]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Print the table, one cell a row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", nargs="+", default=["W1", "W2", "W3", "W4"])
    parser.add_argument("--dt", nargs="+", type=float, default=[0.002, 0.005, 0.01, 0.02])
    parser.add_argument("--filter", nargs="+", default=PAPERS)
    arguments = parser.parse_args()
    print("| world | period | tuned | 2000 to 2009 | ours | times | 3001 to 3010 | ours | times |")
    print("|---|---|---|---|---|---|---|---|---|")
    for world in arguments.worlds:
        for dt in arguments.dt:
            print(row(world, dt, arguments.filter), flush=True)


if __name__ == "__main__":
    main()
