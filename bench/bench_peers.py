"""VQF beside the filters of the package on the simulated rig.

    pip install .[peers]
    python bench/bench_peers.py

VQF (Laidig and Seel 2023) takes gyro and accelerometer, six axes, no wheel; it gets the same
calibrated samples in body axes and the one setting that matters, its time constant. Figures are
mean square errors against the reference encoder [deg^2], then the time for one sample [us];
`real_recordings.py` does the same on measurements.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from real_recordings import own_tilt, vqf_tilt

from twbr_estimation.drives import Drive
from twbr_estimation.recording import FloatArray, Recording, TiltTrack
from twbr_estimation.robot import Setup
from twbr_estimation.scoring.errors import Options, score_recording
from twbr_estimation.simulation import simulate

TIME_CONSTANTS = (1.0, 3.0, 6.0, 12.0)
"""tauAcc of VQF [s]."""
OURS = ("complementary", "ins_odometer")
RIG_SEEDS = range(601, 609)


class Case(NamedTuple):
    """One recording to run everything on."""

    group: str
    recording: Recording
    setup: Setup


def cases() -> Iterator[Case]:
    """Yield the rig's recordings."""
    for world in ("W1", "W2", "W3", "W4"):
        for seed in RIG_SEEDS:
            simulated = simulate(world, 0.005, 60.0, seed)
            yield Case(f"rig {world}, 5 ms", simulated.recording, simulated.setup)


def estimators(case: Case) -> dict[str, Callable[[], FloatArray]]:
    """Return what to run, by name."""
    recording, setup = case.recording, case.setup
    fed = {
        "": Drive(recording, setup).corrected,
        ", no wheel": Drive(replace(recording, wheels=None), setup).corrected,
    }
    found: dict[str, Callable[[], FloatArray]] = {}
    for name in OURS:
        for suffix, corrected in fed.items():
            found[name + suffix] = partial(own_tilt, name, {}, corrected, setup)
    for tau in TIME_CONSTANTS:
        found[f"VQF {tau:g} s"] = partial(vqf_tilt, fed[""], tau)
    return found


def main() -> None:
    """Print the mean error of each estimator in each group, then its time."""
    groups: dict[str, dict[str, list[float]]] = {}
    seconds: dict[str, list[float]] = {}
    for case in cases():
        stamps, tracks = case.recording.imu.stamps, {}
        for name, run in estimators(case).items():
            if name not in seconds:
                run()  # compiles
            start = time.perf_counter()
            tracks[name] = TiltTrack(stamps, run())
            seconds.setdefault(name, []).append((time.perf_counter() - start) / stamps.size)
        scores = score_recording(case.recording, tracks, Options()).estimators
        for name, score in scores.items():
            groups.setdefault(case.group, {}).setdefault(name, []).append(score.mse_deg2)
    names = list(seconds)
    print(f"| | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}")
    for group, found in groups.items():
        cells = (f"{np.mean(found[name]):.3g}" if name in found else "" for name in names)
        print(f"| {group} | {' | '.join(cells)} |")
    print(f"| us a sample | {' | '.join(f'{1e6 * np.median(seconds[n]):.2f}' for n in names)} |")


if __name__ == "__main__":
    main()
