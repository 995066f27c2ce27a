"""What a smoothed reference is worth, as markdown: on real recordings, and for tuning.

Real: mean square error [deg^2] of the smoothed tilt against the optical reference, beside the
causal filter's. Tuning: filters tuned against the encoder and against the smoothed tilt of the
same drives, both judged by the encoder on other drives.

    python bench/smoothing.py --data FOLDER
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from real_recordings import BROAD, broad

from twbr_estimation.batch import run_filter
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.robot import Setup
from twbr_estimation.scoring.score import Association, ScoringOptions, score
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.simulate import Simulated
from twbr_estimation.smoothing import SMOOTHER, smooth
from twbr_estimation.tuning.filter import TuningTask, tune_filter
from twbr_estimation.tuning.objective import TuningSet, prepare


def real_table(folder: Path) -> None:
    """Print the errors on BROAD's recordings with the virtual wheel and without."""
    entry = filter_named(SMOOTHER)
    print("| recording | wheels | ins_odometer | smoothed | its own account [deg] |")
    print("|---|---|---|---|---|")
    for wheels in (True, False):
        rows = []
        for trial in BROAD:
            for axis in "yx":
                log = broad(folder, trial, axis)
                recording = log.recording if wheels else replace(log.recording, wheels=None)
                setup = Setup(log.robot, log.calibration, log.correction or Setup().correction)
                corrected = Drive(recording, setup).corrected
                causal = run_filter(entry, entry.configure(), corrected, setup.robot)
                found = smooth(corrected, setup.robot)
                assert recording.reference is not None
                association = Association(recording.reference, ScoringOptions())
                first = int(recording.imu.stamps[0])
                errors = [
                    score(found.stamps, tilt, association, first).mse_deg2
                    for tilt in (causal.tilt, found.tilt)
                ]
                rows.append([*errors, float(np.degrees(found.deviation))])
                cells = " | ".join(f"{figure:.3f}" for figure in rows[-1])
                print(f"| BROAD {trial[:2]}:{axis} | {wheels} | {cells} |", flush=True)
        cells = " | ".join(f"{figure:.4f}" for figure in np.mean(rows, axis=0))
        print(f"| BROAD mean | {wheels} | {cells} |")


def tuning_table(world: str, dt: float, names: list[str], first: int, drives: int) -> None:
    """Print what filters reach that were tuned against either reference."""
    made = [simulate(world, dt, 60.0, seed) for seed in range(first, first + 2 * drives)]
    training, verification = made[:drives], made[drives:]
    judged = tuple(prepare(each.drive) for each in verification)
    references = {
        "encoder": tuple(prepare(each.drive) for each in training),
        "smoothed": tuple(_smoothed(each) for each in training),
    }
    print(f"\n| {world}, {dt * 1e3:g} ms | tuned against | values | verification MSE |")
    print("|---|---|---|---|")
    for name in names:
        for reference, sets in references.items():
            tuned = tune_filter(TuningTask(sets, judged), name)
            values = ", ".join(f"{key} {value:.4g}" for key, value in tuned.values.items())
            print(f"| {name} | {reference} | {values} | {tuned.judged_mse_deg2:.4f} |", flush=True)


def _smoothed(made: Simulated) -> TuningSet:
    return prepare(made.drive.with_reference(made.drive.smoothed().as_track()))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, help="folder of the real recordings")
    parser.add_argument("--worlds", nargs="*", default=["W1", "W2"])
    parser.add_argument("--dt", nargs="+", type=float, default=[0.005])
    parser.add_argument("--first", type=int, default=6201, help="first seed")
    parser.add_argument("--drives", type=int, default=3, help="to tune on, and to verify on")
    parser.add_argument("--filter", nargs="+", default=["complementary", "alpha_beta_wb"])
    arguments = parser.parse_args()
    if arguments.data is not None:
        real_table(arguments.data)
    for world in arguments.worlds:
        for dt in arguments.dt:
            tuning_table(world, dt, arguments.filter, arguments.first, arguments.drives)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
