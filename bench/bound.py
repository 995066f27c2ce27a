"""The Cramer-Rao bound of the rig beside what filter and smoother reach, as markdown.

Mean over seeds and time of the smallest variance that any estimator of its kind can have, and
of the square error against the truth, both in deg^2; see
`cramer_rao.rig`
for what is taken as known. `--without` switches causes off.

    python bench/bound.py --first 6001 --seeds 10
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from accuracy import CAUSES as BUILT_IN
from cramer_rao.rig import bound

from twbr_estimation.batch import run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.simulate import Simulated
from twbr_estimation.simulation.worlds import world_named
from twbr_estimation.smoothing import SMOOTHER, smooth

CAUSES = {
    **BUILT_IN,
    "impacts": {"impacts": False},
    "vibration": {"vibration": 0.0},
    "gyro sensitivity": {"gyro_acceleration_deg": 0.0},
    "saturation": {"digital": False},
}
"""What can be switched off, by name; `saturation` takes the counts of all sensors with it."""
SQUARE_DEGREES = np.degrees(1.0) ** 2


def figures_of(made: Simulated, skip: float, bounded: bool) -> list[float]:
    """Return bound, error and NEES of filter and smoother, from `skip` seconds on."""
    begin = round(skip / made.recording.dt)
    assert made.recording.truth is not None
    corrected = made.drive.corrected
    entry, truth = filter_named(SMOOTHER), made.recording.truth.tilt
    causal = run_filter(entry, entry.configure(), corrected, made.setup.robot)
    found = smooth(corrected, made.setup.robot)
    figures = []
    limits = bound(made) if bounded and made.world.track_width == 0.0 else None
    for tilt, variance, limit in (
        (causal.tilt, causal.tilt_variance, None if limits is None else limits.causal),
        (found.tilt, found.variance, None if limits is None else limits.hindsight),
    ):
        square = np.square(tilt - truth)[begin:]
        figures.append(np.nan if limit is None else float(np.mean(limit[begin:])) * SQUARE_DEGREES)
        figures.append(float(np.mean(square)) * SQUARE_DEGREES)
        figures.append(float(np.mean(square / variance[begin:])))
    return figures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", nargs="*", default=["W1", "W2", "W3", "W4"])
    parser.add_argument("--dt", nargs="+", type=float, default=[0.002, 0.01])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=6001, help="first seed")
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--skip", type=float, default=5.0, help="not looked at [s]")
    parser.add_argument("--no-bound", action="store_true", help="errors only, much faster")
    parser.add_argument("--without", nargs="*", default=[], choices=list(CAUSES))
    arguments = parser.parse_args()
    fields = {name: value for cause in arguments.without for name, value in CAUSES[cause].items()}
    print("| world | period | bound | ins_odometer | NEES | bound, hindsight | smoothed | NEES |")
    print("|---|---|---|---|---|---|---|---|")
    for name in arguments.worlds:
        world = replace(world_named(name), **fields)
        for dt in arguments.dt:
            rows = [
                figures_of(
                    simulate(world, dt, arguments.duration, seed),
                    arguments.skip,
                    not arguments.no_bound,
                )
                for seed in range(arguments.first, arguments.first + arguments.seeds)
            ]
            cells = " | ".join(
                "" if np.isnan(figure) else f"{figure:.4f}" for figure in np.mean(rows, axis=0)
            )
            print(f"| {name} | {dt * 1e3:g} ms | {cells} |", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
