"""The Kalman filters of the paper's outlook beside the tuned `kalman`, on the simulated rig.

    python bench/bench_outlook.py [--seeds N]

`kalman` is tuned for each world and period on recordings of its own; the outlook's filters keep
their defaults. Figures are mean (median) square errors over recordings that no tuning has seen.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np

from twbr_estimation.angles import wrapped
from twbr_estimation.batch import CorrectedTrack, run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.simulation import Simulated, simulate

CASES = tuple(product(("paper", "W1", "W2"), (0.002, 0.01)))
TUNING_SEEDS = range(11, 17)
FIRST_SEED = 501
GRID = tuple(product((3e-7, 1e-6, 3e-6, 1e-5, 3e-5), (1e-14, 1e-13, 1e-12)))
"""Values of q1 and q2 among which the best is taken."""
OUTLOOK = ("kalman_adaptive", "kalman_extended")


class Corrected(NamedTuple):
    """One recording, corrected."""

    simulated: Simulated
    corrected: CorrectedTrack


def drives(world: str, dt: float, seeds: range) -> list[Corrected]:
    """Return one minute per seed."""
    simulated = [simulate(world, dt, 60.0, seed) for seed in seeds]
    return [Corrected(each, each.drive.corrected) for each in simulated]


def errors(name: str, values: Mapping[str, float], found: list[Corrected]) -> list[float]:
    """Return the mean square error of each recording [deg^2]."""
    entry, mse = filter_named(name), []
    for simulated, corrected in found:
        truth = simulated.recording.truth
        assert truth is not None
        track = run_filter(entry, entry.configure(values), corrected, simulated.setup.robot)
        error = track.tilt - truth.tilt
        mse.append(float(np.mean(np.degrees(wrapped(error)) ** 2)))
    return mse


def main(seeds: int) -> None:
    """Print a table."""
    print("| world | period | `kalman` tuned | `kalman` defaults |", end="")
    print("".join(f" `{name}` |" for name in OUTLOOK))
    print("|---|---|---|---|---|---|")
    for world, dt in CASES:
        training = drives(world, dt, TUNING_SEEDS)
        q1, q2 = min(
            GRID, key=lambda q: np.mean(errors("kalman", {"q1": q[0], "q2": q[1]}, training))
        )
        fresh = drives(world, dt, range(FIRST_SEED, FIRST_SEED + seeds))
        rows = [errors("kalman", {"q1": q1, "q2": q2}, fresh), errors("kalman", {}, fresh)]
        rows += [errors(name, {}, fresh) for name in OUTLOOK]
        cells = "".join(f" {np.mean(row):.2f} ({np.median(row):.2f}) |" for row in rows)
        print(f"| {world} | {1e3 * dt:g} ms |{cells}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    main(parser.parse_args().seeds)
