"""What samples at 1 kHz give a loop of 10 or 20 ms: mean square errors on the simulated rig.

python bench/bench_oversampling.py [--seeds N]
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from twbr_estimation.angles import wrapped
from twbr_estimation.batch import CorrectedTrack, oversampled, run_filter
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.recording import ImuTrack
from twbr_estimation.simulation import Simulated, simulate

FILTERS = ("complementary", "kalman", "ins_odometer")
WORLDS = ("W1", "W2", "W4")
FIRST_SEED = 401
FAST = 0.001
LOOPS = (10, 20)
"""Samples in an interval of the loop."""


def mse_deg2(name: str, corrected: CorrectedTrack, simulated: Simulated) -> float:
    """Return the mean square error against the truth [deg^2]."""
    entry, truth = filter_named(name), simulated.recording.truth
    assert truth is not None
    track = run_filter(entry, entry.configure(), corrected, simulated.setup.robot)
    error = track.tilt - np.interp(track.stamps, truth.stamps, truth.tilt)
    return float(np.mean(np.degrees(wrapped(error)) ** 2))


def plain(simulated: Simulated, every: int) -> CorrectedTrack:
    """Return what a loop gets that reads one sample an interval."""
    imu = simulated.recording.imu
    slow = ImuTrack(imu.stamps[::every], imu.gyro[::every], imu.accel[::every])
    return Drive(replace(simulated.recording, imu=slow), simulated.setup).corrected


def main(seeds: int) -> None:
    """Print mean (median) over the seeds for every world, loop and filter."""
    print("| world | loop | filter | one sample | combined | every sample |")
    print("|---|---|---|---|---|---|")
    for world in WORLDS:
        drives = [simulate(world, FAST, 60.0, FIRST_SEED + k) for k in range(seeds)]
        fast = [s.drive.corrected for s in drives]
        for every in LOOPS:
            slow = [plain(simulated, every) for simulated in drives]
            kept = [oversampled(corrected, FAST * every) for corrected in fast]
            for name in FILTERS:
                cells = []
                for tracks in (slow, kept, fast):
                    mse = [mse_deg2(name, t, s) for t, s in zip(tracks, drives, strict=True)]
                    cells.append(f"{np.mean(mse):.3g} ({np.median(mse):.3g})")
                print(f"| {world} | {every} ms | `{name}` | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    main(parser.parse_args().seeds)
