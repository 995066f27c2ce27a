"""Measure the error of `ins_odometer` under faults, and whether its variance fits its error.

    python bench/robustness.py

Faults: mean square error in, and 2 s after, the middle third of each recording [deg^2], in
which the fault lasts; then the largest error 2 s after a start 30 deg wrong [deg].
Consistency: squared error over variance (NEES, against the truth) and squared innovation of
the wheels over its variance (NIS), means over time and seeds; 1 is ideal, and the mean of ten
independent values is between 0.32 and 2.05 in 95 % of the cases.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from twbr_estimation.batch import CorrectedTrack, EstimateTrack, run_filter
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import Setup
from twbr_estimation.samples import CorrectedSample, TiltEstimate
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.simulate import Simulated

ENTRY = filter_named("ins_odometer")
DURATION = 60.0
FAULT = (20.0, 40.0)
"""When a fault begins and ends [s]."""
SETTLED = 2.0
"""Time after a fault or a wrong start that is left for the return [s]."""
WRONG = math.radians(30.0)


@cache
def made(world: str, dt: float, seed: int) -> Simulated:
    """Return a simulated recording."""
    return simulate(world, dt, DURATION, seed)


def corrected(simulated: Simulated, keep: Any = slice(None)) -> CorrectedTrack:
    """Return its corrected samples, of the IMU samples that `keep` chooses."""
    imu = simulated.recording.imu
    kept = replace(imu, stamps=imu.stamps[keep], gyro=imu.gyro[keep], accel=imu.accel[keep])
    return Drive(replace(simulated.recording, imu=kept), simulated.setup).corrected


def run(track: CorrectedTrack, setup: Setup, values: Mapping[str, float]) -> EstimateTrack:
    """Return the estimates of the filter."""
    return run_filter(ENTRY, ENTRY.configure(values), track, setup.robot)


def seconds(track: CorrectedTrack) -> FloatArray:
    """Return the time since the first sample [s], (n,)."""
    return np.asarray((track.stamps - track.stamps[0]) * 1e-9)


def truth_at(simulated: Simulated, track: CorrectedTrack) -> FloatArray:
    """Return the true tilt at the samples [rad], (n,)."""
    truth = simulated.recording.truth
    assert truth is not None
    return np.interp(track.stamps, truth.stamps, truth.tilt)


def changed(track: CorrectedTrack, **changes: Callable[[FloatArray], FloatArray]) -> CorrectedTrack:
    """Return a track some fields of which are changed while the fault lasts."""
    columns, time = track.columns.copy(), seconds(track)
    during = (time >= FAULT[0]) & (time < FAULT[1])
    for name, change in changes.items():
        row = CorrectedSample._fields.index(name)
        columns[row, during] = change(columns[row, during])
    return CorrectedTrack(track.stamps, columns)


def silent(simulated: Simulated) -> CorrectedTrack:
    """The encoder's messages stop."""
    return changed(corrected(simulated), wheel_count=np.zeros_like)


def frozen(simulated: Simulated) -> CorrectedTrack:
    """The encoder keeps sending one angle."""
    return changed(corrected(simulated), wheel_angle=lambda angle: np.full_like(angle, angle[0]))


def late(simulated: Simulated) -> CorrectedTrack:
    """The encoder's stamps are 10 ms late."""
    recording = simulated.recording
    assert recording.wheels is not None
    wheels = replace(recording.wheels, stamps=recording.wheels.stamps + 10_000_000)
    return corrected(replace(simulated, recording=replace(recording, wheels=wheels)))


def thinned(simulated: Simulated) -> CorrectedTrack:
    """A fifth of the IMU's samples are lost."""
    random = np.random.default_rng(simulated.seed)
    count = simulated.recording.imu.stamps.size
    return corrected(simulated, np.flatnonzero(random.uniform(size=count) > 0.2))


FAULTS: dict[str, Callable[[Simulated], CorrectedTrack]] = {
    "none": corrected,
    "encoder silent for 20 s": silent,
    "encoder frozen for 20 s": frozen,
    "encoder 10 ms late throughout": late,
    "a fifth of the samples lost throughout": thinned,
}


def faults_table(arguments: argparse.Namespace, values: Mapping[str, float]) -> None:
    """Print the cost of every fault."""
    print("| world | period | fault | during | largest seed | after | largest seed |")
    print("|---|---|---|---|---|---|---|")
    for world, dt, seeds in cells(arguments):
        for name, spoil in FAULTS.items():
            during, after = [], []
            for seed in seeds:
                simulated = made(world, dt, seed)
                track = spoil(simulated)
                estimate = run(track, simulated.setup, values)
                error = np.square(np.degrees(estimate.tilt - truth_at(simulated, track)))
                time = seconds(track)
                during.append(np.mean(error[(time >= FAULT[0]) & (time < FAULT[1])]))
                after.append(np.mean(error[time >= FAULT[1] + SETTLED]))
            figures = (np.mean(during), np.max(during), np.mean(after), np.max(after))
            print(row(world, dt, name, *figures), flush=True)


def starts_table(arguments: argparse.Namespace, values: Mapping[str, float]) -> None:
    """Print what is left of a wrong start in the middle of a drive."""
    print("| world | period | starts | median | largest | within 2 deg | believed, yet wrong |")
    print("|---|---|---|---|---|---|---|")
    for world, dt, seeds in cells(arguments):
        found = [wrong_start(made(world, dt, s), w, values) for s in seeds for w in (WRONG, -WRONG)]
        left, stddev = np.abs(found).T
        close = int(np.sum(left < 2.0))
        missed = int(np.sum((left > 5.0) & (stddev < 0.3 * left)))
        cells_ = (f"{len(found)}", f"{np.median(left):.2f}", f"{left.max():.2f}", close, missed)
        print(f"| {world} | {dt * 1e3:g} ms | " + " | ".join(map(str, cells_)) + " |", flush=True)


def wrong_start(
    simulated: Simulated, wrong: float, values: Mapping[str, float]
) -> tuple[float, float]:
    """Return error and standard deviation [deg] 2 s after a start that far from the truth."""
    track = corrected(simulated)
    truth = truth_at(simulated, track)
    first = int(np.searchsorted(seconds(track), FAULT[0]))
    last = int(np.searchsorted(seconds(track), FAULT[0] + SETTLED))
    sample = CorrectedSample(*(float(value) for value in track.columns[:, first]))
    parameters = ENTRY.configure(values)
    coefficients = ENTRY.derive(parameters, simulated.setup.robot)
    start = TiltEstimate(float(truth[first]) + wrong, sample.gyro_y)
    state = ENTRY.reset(start, sample, coefficients)
    rest = np.ascontiguousarray(track.columns[:, first + 1 : last + 1])
    cut = CorrectedTrack(track.stamps[first + 1 : last + 1], rest)
    end = run_filter(ENTRY, parameters, cut, simulated.setup.robot, state)
    error = math.degrees(end.tilt[-1] - truth[last])
    return error, math.degrees(math.sqrt(end.tilt_variance[-1]))


def consistency_table(arguments: argparse.Namespace, values: Mapping[str, float]) -> None:
    """Print whether errors and innovations are as large as the filter's variance says."""
    print("| world | period | NEES | NIS | invalid |")
    print("|---|---|---|---|---|")
    for world, dt, seeds in cells(arguments):
        found = [consistency(made(world, dt, seed), values) for seed in seeds]
        print(row(world, dt, *np.mean(found, axis=0)), flush=True)


def consistency(simulated: Simulated, values: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the means over time of NEES and NIS, and the share of a stddev above 0.2 rad."""
    track, state = corrected(simulated), None
    parameters, truth = ENTRY.configure(values), truth_at(simulated, track)
    second = round(1e9 / float(np.median(np.diff(track.stamps))))
    squares, surprises, invalid = [], [], []
    for first in range(0, truth.size, second):
        part = slice(first, first + second)
        columns = np.ascontiguousarray(track.columns[:, part])
        piece = CorrectedTrack(track.stamps[part], columns)
        estimate = run_filter(ENTRY, parameters, piece, simulated.setup.robot, state)
        state = estimate.state
        squares.append(np.square(estimate.tilt - truth[part]) / estimate.tilt_variance)
        surprises.append(state.aiding.surprise)
        invalid.append(estimate.tilt_variance > 0.2**2)
    shares = float(np.mean(np.concatenate(invalid)))
    return float(np.mean(np.concatenate(squares))), float(np.mean(surprises)), shares


def cells(arguments: argparse.Namespace) -> list[tuple[str, float, range]]:
    """Return every world and period with the seeds to run."""
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    return [(world, dt, seeds) for world in arguments.worlds for dt in arguments.dt]


def row(world: str, dt: float, *cells: Any) -> str:
    """Return one row of a table."""
    texts = (cell if isinstance(cell, str) else f"{cell:.3f}" for cell in cells)
    return f"| {world} | {dt * 1e3:g} ms | " + " | ".join(texts) + " |"


TABLES = {"faults": faults_table, "starts": starts_table, "consistency": consistency_table}


def main() -> None:
    """Print the tables asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", nargs="+", choices=list(TABLES), default=list(TABLES))
    parser.add_argument("--worlds", nargs="+", default=["W1", "W2"])
    parser.add_argument("--dt", nargs="+", type=float, default=[0.002, 0.01, 0.02])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=2000, help="first seed")
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    values = {name: float(value) for name, value in (each.split("=") for each in arguments.set)}
    for name in arguments.tables:
        TABLES[name](arguments, values)
        print()


if __name__ == "__main__":
    main()
