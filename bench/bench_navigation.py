"""What a sample costs `ins_odometer`, compiled and live, beside peers in one run.

    pip install .[peers]
    python bench/bench_navigation.py

Peers are VQF's offline filter, which is C++ and has neither wheels nor a variance, and the
two products F P F' of a Kalman filter of as many states written with numpy, as filterpy does. All
are taken in turns; the least time counts, since other work on the machine only adds. Ratios hold
on other machines, microseconds do not.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from twbr_estimation.batch import CorrectedTrack
from twbr_estimation.batch.running import run_compiled
from twbr_estimation.filters import filter_named
from twbr_estimation.filters.inertial.error_state import STATES
from twbr_estimation.live_code.providing import compiled_filter
from twbr_estimation.live_code.running import CompiledStep
from twbr_estimation.pipeline.watched_filter import WatchedFilter
from twbr_estimation.robot import Setup
from twbr_estimation.samples import CorrectedSample
from twbr_estimation.simulation import simulate

WORLDS = (("W1", "one wheel"), ("W1", "no wheel"), ("W4", "two wheels"))
PERIODS = (0.001, 0.002, 0.005, 0.01, 0.02)
SAMPLES, LIVE = 10_000, 1000
"""Samples of a recording, and the last ones of it that are taken live."""
SEED = 701
REQUIRED = 1.0
"""Microseconds a sample at most, compiled."""
ENTRY = filter_named("ins_odometer")

Cases = dict[tuple[str, str, float], tuple[CorrectedTrack, Setup]]
"""Samples and setup by world, wheels and period [s]."""


def drive(world: str, wheels: str, period: float) -> tuple[CorrectedTrack, Setup]:
    """Return the first samples of a drive that are past the start."""
    made = simulate(world, period, 10.0 + SAMPLES * period, SEED)
    track = made.drive.corrected
    columns = np.ascontiguousarray(track.columns[:, -SAMPLES:])
    if wheels == "no wheel":
        columns[CorrectedSample._fields.index("wheel_count")] = 0.0
    return CorrectedTrack(track.stamps[-SAMPLES:], columns), made.setup


def least(runs: dict[Any, Callable[[], object]], rounds: int) -> dict[Any, float]:
    """Return the least time of each [s], taken in turns."""
    found = dict.fromkeys(runs, np.inf)
    for run in runs.values():
        run()
    for _ in range(rounds):
        for name, run in runs.items():
            begin = time.perf_counter()
            run()
            found[name] = min(found[name], time.perf_counter() - begin)
    return found


def compiled(cases: Cases, rounds: int) -> None:
    """Print the time of a compiled sample."""
    runs: dict[Any, Callable[[], object]] = {
        case: partial(run_compiled, ENTRY, ENTRY.configure(), track, setup.robot, None)
        for case, (track, setup) in cases.items()
    }
    try:
        runs["VQF"] = vqf_run(cases["W1", "one wheel", 0.005][0])
    except ModuleNotFoundError:
        print("VQF is not installed (pip install .[peers]): left out")
    taken = {name: 1e6 * seconds / SAMPLES for name, seconds in least(runs, rounds).items()}
    peer = taken.pop("VQF", None)
    print(f"compiled, least of {rounds} runs of {SAMPLES} samples, the beginning of a run included")
    if peer is not None:
        print(f"  VQF: {peer:.2f} us")
    for (world, wheels, period), own in taken.items():
        judged = "" if own <= REQUIRED else f"  more than {REQUIRED:g} us"
        ratio = "" if peer is None else f", {own / peer:.2f} times VQF"
        print(f"  {world} {wheels:10} {1e3 * period:2.0f} ms: {own:5.2f} us{ratio}{judged}")


def vqf_run(track: CorrectedTrack) -> Callable[[], object]:
    """Return a run of VQF's offline filter over the same samples."""
    import vqf

    gyro, accel = (
        np.column_stack([track.field(f"{sensor}_{axis}") for axis in "xyz"])
        for sensor in ("gyro", "accel")
    )
    return lambda: vqf.offlineVQF(gyro, accel, None, 0.005)


def live(cases: Cases, rounds: int) -> None:
    """Print the time of a live step: mean and 99th percentile of each sample's least time."""
    random = np.random.default_rng(0)
    f, p = random.normal(size=(2, STATES, STATES))
    products = 1e6 * least({0: lambda: f @ p @ f.T}, rounds)[0]
    print(f"F P F' in numpy takes {products:.1f} us")
    codes: dict[str, CompiledStep | None] = {"interpreted": None}
    code = compiled_filter(ENTRY)
    if code is None:
        print("no machine code: python -m twbr_estimation.live_code.precompile")
    else:
        codes["machine code"] = code
    for name, used in codes.items():
        print(f"live, {name}, with its monitor, least of 20 runs of each sample")
        for (world, wheels, period), (track, setup) in cases.items():
            steps = 1e6 * live_steps(track, setup, used)
            mean, p99 = float(np.mean(steps)), float(np.percentile(steps, 99))
            print(
                f"  {world} {wheels:10} {1e3 * period:2.0f} ms: mean {mean:5.1f}, p99 {p99:5.1f} "
                f"us; {mean / products:.1f} and {p99 / products:.1f} times F P F'"
            )


def live_steps(track: CorrectedTrack, setup: Setup, code: CompiledStep | None) -> np.ndarray:
    """Return the least time of each sample's step [s]."""
    samples = [CorrectedSample(*column) for column in track.columns[:, -LIVE:].T.tolist()]
    found = np.full(len(samples) - 1, np.inf)
    for _ in range(20):
        running = WatchedFilter(ENTRY, robot=setup.robot)
        running.use(code)
        running.step(samples[0])
        for index, sample in enumerate(samples[1:]):
            begin = time.perf_counter()
            running.step(sample)
            found[index] = min(found[index], time.perf_counter() - begin)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=50, help="runs; the fastest counts")
    rounds = parser.parse_args().rounds
    cases = {(*which, period): drive(*which, period) for which in WORLDS for period in PERIODS}
    compiled(cases, rounds)
    live(cases, rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
