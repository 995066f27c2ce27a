"""Measure filters on the simulated worlds and on real recordings; the tables of docs/accuracy.md.

Each cell is the mean over seeds of the mean square error against the reference encoder
[deg^2], followed by the median and the largest seed. Everything runs with the defaults.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from twbr_estimation.batch import correct, run_filter
from twbr_estimation.evaluation import Association, Options, score
from twbr_estimation.filters import filter_named
from twbr_estimation.imports import imported
from twbr_estimation.pairing import pair
from twbr_estimation.recording import Recording
from twbr_estimation.robot import Setup
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.worlds import World, world_named

CAUSES = {
    "residual": {"calibration_residual": 0.0},
    "slip": {"slips_per_second": 0.0},
    "lever arm": {"lever_arm_error": 0.0},
    "radius": {"wheel_radius_error": 0.0},
    "mounting": {"mounting_error_deg": 0.0},
    "gyro gain": {"gyro_scale_error": 0.0},
}
"""What can be switched off in a world, by name."""
BROAD = (
    "12_undisturbed_slow_translation_C",
    "14_undisturbed_slow_translation_with_breaks_B",
    "25_disturbed_tapping_B",
)


def errors_of(
    recording: Recording,
    setup: Setup,
    names: list[str],
    values: dict[str, float],
    skip: float = 0.0,
) -> dict[str, float]:
    """Return the mean square errors of several filters on one recording [deg^2]."""
    assert recording.reference is not None
    corrected = correct(pair(recording.imu, recording.wheels), setup)
    association = Association(recording.reference, Options())
    first = int(recording.imu.stamps[0]) + round(skip * 1e9)
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
    """Yield the worlds, and with `--causes` each with one cause after the other switched off."""
    for name in arguments.worlds:
        world = world_named(name)
        yield world
        for cause, fields in CAUSES.items() if arguments.causes else ():
            yield replace(world, name=f"{name} without {cause}", **fields)


def real_table(folder: Path, names: list[str], values: dict[str, float]) -> None:
    """Print the errors on the BROAD and UIUC recordings."""
    print("| recording | wheels | " + " | ".join(names) + " |")
    print("|---|---|" + "---|" * len(names))
    for wheels in (True, False):
        total = []
        for trial in BROAD:
            path = folder / "broad_translation" / f"{trial}.mat"
            for axis in "yx":
                log = imported.load(path, "broad", imported.Options(axis=axis))
                total.append(row(f"BROAD {trial[:2]}:{axis}", log, wheels, names, values))
        mean = np.mean(total, axis=0)
        print(f"| BROAD mean | {wheels} | " + " | ".join(f"{x:.4f}" for x in mean) + " |")
    for speed in ("slow", "medium"):
        path = folder / "uiuc_mpu6050_encoder" / f"raw_pitch_{speed}.mat"
        row(f"UIUC {speed}", imported.load(path, "uiuc"), False, names, values, 60.0)


def row(
    title: str,
    log: imported.ImportedLog,
    wheels: bool,
    names: list[str],
    values: dict[str, float],
    skip: float = 0.0,
) -> list[float]:
    """Print one recording's errors and return them [deg^2]."""
    recording = log.recording if wheels else replace(log.recording, wheels=None)
    setup = Setup(log.robot, log.calibration, log.correction or Setup().correction)
    found = errors_of(recording, setup, names, values, skip)
    print(f"| {title} | {wheels} | " + " | ".join(f"{found[name]:.3f}" for name in names) + " |")
    return [found[name] for name in names]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", nargs="*", default=["W1", "W2", "W3", "W4"])
    parser.add_argument("--dt", nargs="+", type=float, default=[0.002, 0.005, 0.01, 0.02])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=2000, help="first seed")
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--filter", nargs="+", default=["ins_odometer"])
    parser.add_argument("--causes", action="store_true", help="switch one cause off at a time")
    parser.add_argument("--data", type=Path, help="folder of the real recordings")
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    pairs = (entry.split("=") for entry in arguments.set)
    values = {name: float(value) for name, value in pairs}
    worlds_table(arguments, values)
    if arguments.data is not None:
        real_table(arguments.data, arguments.filter, values)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
