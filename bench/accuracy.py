"""Measure filters on the simulated worlds; the tables of docs/accuracy.md.

Each cell is the mean over seeds of the mean square error against the reference encoder
[deg^2], followed by the median and the largest seed. Everything runs with the defaults.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from twbr_estimation.batch import run_filter
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.recording import Recording
from twbr_estimation.robot import Setup
from twbr_estimation.scoring.score import Association, ScoringOptions, score
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.worlds import World, world_named

CAUSES = {
    "residual": {"calibration_residual": 0.0},
    "slip": {"slips_per_second": 0.0},
    "lever arm": {"lever_arm_error": 0.0},
    "radius": {"wheel_radius_error": 0.0},
    "mounting": {"mounting_error_deg": 0.0},
    "gyro gain": {"gyro_scale_error": 0.0},
    "cross axis": {"gyro_cross_axis": 0.0},
    "control steps": {"control_period": 0.0005},
}
"""What can be switched off in a world, by name; control steps are the voltage's jumps, which
fall onto the samples of slow loops."""


def errors_of(
    recording: Recording, setup: Setup, names: list[str], values: dict[str, float]
) -> dict[str, float]:
    """Return the mean square errors of several filters on one recording [deg^2]."""
    assert recording.reference is not None
    corrected = Drive(recording, setup).corrected
    association = Association(recording.reference, ScoringOptions())
    first = int(recording.imu.stamps[0])
    found = {}
    for name in names:
        entry = filter_named(name)
        mine = {key: value for key, value in values.items() if key in entry.parameters._fields}
        track = run_filter(entry, entry.configure(mine), corrected, setup.robot)
        found[name] = score(track.stamps, track.tilt, association, first).mse_deg2
    return found


def cell(figures: list[float]) -> str:
    """Return mean (median, largest)."""
    mean, median, largest = np.mean(figures), np.median(figures), np.max(figures)
    return f"{mean:.3f} ({median:.3f}, {largest:.2f})"


def worlds_table(arguments: argparse.Namespace, values: dict[str, float]) -> None:
    """Print one row a world and filter, one column a sampling period."""
    print("| world | filter | " + " | ".join(f"{dt * 1e3:g} ms" for dt in arguments.dt) + " |")
    print("|---|---|" + "---|" * len(arguments.dt))
    for world in variants(arguments):
        columns: dict[str, list[str]] = {name: [] for name in arguments.filter}
        for dt in arguments.dt:
            figures: dict[str, list[float]] = {name: [] for name in arguments.filter}
            for seed in range(arguments.first, arguments.first + arguments.seeds):
                made = simulate(world, dt, arguments.duration, seed)
                found = errors_of(made.recording, made.setup, arguments.filter, values)
                for name, figure in found.items():
                    figures[name].append(figure)
            for name in arguments.filter:
                columns[name].append(cell(figures[name]))
        for name in arguments.filter:
            print(f"| {world.name} | {name} | " + " | ".join(columns[name]) + " |", flush=True)


def variants(arguments: argparse.Namespace) -> Iterator[World]:
    """Yield the worlds, and each with one cause after the other switched off."""
    for name in arguments.worlds:
        world = world_named(name)
        yield world
        for cause in arguments.causes:
            yield replace(world, name=f"{name} without {cause}", **CAUSES[cause])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", nargs="*", default=["W1", "W2", "W3", "W4"])
    parser.add_argument("--dt", nargs="+", type=float, default=[0.002, 0.005, 0.01, 0.02])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=2000, help="first seed")
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--filter", nargs="+", default=["ins_odometer"])
    parser.add_argument(
        "--causes", nargs="+", choices=list(CAUSES), default=[], help="switch off, one at a time"
    )
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    pairs = (entry.split("=") for entry in arguments.set)
    values = {name: float(value) for name, value in pairs}
    worlds_table(arguments, values)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
