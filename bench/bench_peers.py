"""VQF beside the filters of the package, on real recordings and on the simulated rig.

    pip install .[import,peers]
    python bench/bench_peers.py [DATA]

VQF (Laidig and Seel 2023) takes gyro and accelerometer, six axes, no wheel; it gets the same
calibrated samples in body axes and the one setting that matters, its time constant. DATA holds
`broad_translation` and `uiuc_mpu6050_encoder`; without it only the rig is run. Figures are mean
square errors against the reference encoder [deg^2], then the time for one sample [us].
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import vqf

from twbr_estimation.batch import CorrectedTrack, correct, run_filter
from twbr_estimation.evaluation import Options, score_recording
from twbr_estimation.filters import filter_named
from twbr_estimation.imports import imported
from twbr_estimation.messages import tilt_of_quaternion
from twbr_estimation.pairing import pair
from twbr_estimation.recording import FloatArray, Recording, TiltTrack
from twbr_estimation.robot import Robot, Setup
from twbr_estimation.simulation import simulate

TIME_CONSTANTS = (1.0, 3.0, 6.0, 12.0)
"""tauAcc of VQF [s]."""
OURS = ("complementary", "ins_odometer")
BROAD = (
    "12_undisturbed_slow_translation_C",
    "14_undisturbed_slow_translation_with_breaks_B",
    "25_disturbed_tapping_B",
)
UIUC = ("raw_pitch_slow", "raw_pitch_medium")
UIUC_SKIP = 60.0
"""Start of the UIUC files that is not scored [s]."""
RIG_SEEDS = range(601, 609)


class Case(NamedTuple):
    """One recording to run everything on."""

    group: str
    recording: Recording
    setup: Setup
    skip: float = 0.0


def cases(data: Path | None) -> Iterator[Case]:
    """Yield the real recordings, then the rig's."""
    if data is not None:
        for name in BROAD:
            for axis in "xy":
                path = data / "broad_translation" / f"{name}.mat"
                log = imported.load(path, "broad", imported.Options(axis=axis))
                yield Case(f"BROAD {name[:2]}:{axis}", log.recording, _setup(log))
        for name in UIUC:
            path = data / "uiuc_mpu6050_encoder" / f"{name}.mat"
            log = imported.load(path, "uiuc")
            yield Case(f"UIUC {name[10:]}", log.recording, _setup(log), UIUC_SKIP)
    for world in ("W1", "W2", "W3", "W4"):
        for seed in RIG_SEEDS:
            simulated = simulate(world, 0.005, 60.0, seed)
            yield Case(f"rig {world}, 5 ms", simulated.recording, simulated.setup)


def _setup(log: imported.ImportedLog) -> Setup:
    default = Setup()
    return Setup(log.robot, log.calibration, log.correction or default.correction)


def own_tilt(name: str, corrected: CorrectedTrack, robot: Robot) -> FloatArray:
    """Return the tilt [rad] by a filter of the package with its defaults."""
    entry = filter_named(name)
    return run_filter(entry, entry.configure(), corrected, robot).tilt


def vqf_tilt(corrected: CorrectedTrack, dt: float, time_constant: float) -> FloatArray:
    """Return the tilt [rad] by VQF from calibrated samples in body axes."""
    gyro, accel = (
        np.column_stack([corrected.field(f"{kind}_{axis}") for axis in "xyz"])
        for kind in ("gyro", "accel")
    )
    quaternions = vqf.VQF(dt, tauAcc=time_constant).updateBatch(gyro, accel)["quat6D"]
    w, x, y, z = quaternions.T
    return np.asarray(tilt_of_quaternion(x, y, z, w), dtype=np.float64)


def estimators(case: Case) -> dict[str, Callable[[], FloatArray]]:
    """Return what to run, by name."""
    recording, setup = case.recording, case.setup
    fed = {"": correct(pair(recording.imu, recording.wheels), setup)}
    if recording.wheels is not None:
        fed[", no wheel"] = correct(pair(recording.imu, None), setup)
    found: dict[str, Callable[[], FloatArray]] = {}
    for name in OURS:
        for suffix, corrected in fed.items():
            found[name + suffix] = partial(own_tilt, name, corrected, setup.robot)
    for tau in TIME_CONSTANTS:
        found[f"VQF {tau:g} s"] = partial(vqf_tilt, fed[""], recording.dt, tau)
    return found


def main(data: Path | None) -> None:
    """Print the mean error of each estimator in each group, then its time."""
    groups: dict[str, dict[str, list[float]]] = {}
    seconds: dict[str, list[float]] = {}
    for case in cases(data):
        stamps, tracks = case.recording.imu.stamps, {}
        for name, run in estimators(case).items():
            if name not in seconds:
                run()  # compiles
            start = time.perf_counter()
            tracks[name] = TiltTrack(stamps, run())
            seconds.setdefault(name, []).append((time.perf_counter() - start) / stamps.size)
        scores = score_recording(case.recording, tracks, Options(skip=case.skip)).estimators
        for name, score in scores.items():
            groups.setdefault(case.group, {}).setdefault(name, []).append(score.mse_deg2)
    names = list(seconds)
    print(f"| | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}")
    for group, found in groups.items():
        cells = (f"{np.mean(found[name]):.3g}" if name in found else "" for name in names)
        print(f"| {group} | {' | '.join(cells)} |")
    print(f"| us a sample | {' | '.join(f'{1e6 * np.median(seconds[n]):.2f}' for n in names)} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
