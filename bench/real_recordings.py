"""Filters of the package, VQF and the chip's own processor on real recordings.

    pip install .[import,peers]
    python bench/real_recordings.py DATA

DATA holds `broad_translation` and `uiuc_mpu6050_encoder`. Figures are mean square errors
against the reference [deg^2]. Filters run with their defaults but where the head says best:
those have the time constant, of those at the top of this file, that suits the file best.
VQF (Laidig and Seel 2023) gets the calibrated samples in body axes and their mean period.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbr_estimation.batch import CorrectedTrack, run_filter
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.imports import imported
from twbr_estimation.recording import FloatArray, Recording, TiltTrack
from twbr_estimation.robot import Setup
from twbr_estimation.ros_messages import tilt_of_quaternion
from twbr_estimation.scoring.score import Association, ScoringOptions, score

BROAD = (
    "12_undisturbed_slow_translation_C",
    "14_undisturbed_slow_translation_with_breaks_B",
    "25_disturbed_tapping_B",
)
UIUC = ("raw_pitch_slow", "raw_pitch_medium")
UIUC_SKIP = 60.0
"""Start of the UIUC files that is not scored [s]."""
DEFAULTS = ("ins_odometer", "complementary", "alpha_beta_wb", "kalman_tuned")
TIME_CONSTANTS = (0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0)
"""Of the complementary filter [s]."""
VQF_TIME_CONSTANTS = (1.0, 2.0, 3.0, 4.0, 6.0, 9.0, 12.0, 20.0)
VQF_SHOWN = (3.0, 6.0)
"""Shown for every file: the best two for all of BROAD."""
_DELAY_STEPS = 3


class Case(NamedTuple):
    """One recording, with its wheels or without."""

    group: str
    title: str
    recording: Recording
    setup: Setup
    skip: float


class Figures(NamedTuple):
    """Mean square errors of one estimator [deg^2]."""

    as_is: float
    freed: float
    """Without the estimate's own mean error and delay."""


def broad(data: Path, trial: str, axis: str) -> imported.ImportedLog:
    """Read one trial for the tilt about one axis."""
    path = data / "broad_translation" / f"{trial}.mat"
    return imported.load(path, "broad", imported.ImportOptions(axis=axis))


def uiuc(data: Path, name: str) -> imported.ImportedLog:
    """Read one file of the motor shaft."""
    return imported.load(data / "uiuc_mpu6050_encoder" / f"{name}.mat", "uiuc")


def setup_of(log: imported.ImportedLog) -> Setup:
    """Return what an imported log says of robot and sensor."""
    return Setup(log.robot, log.calibration, log.correction or Setup().correction)


def cases(data: Path) -> Iterator[Case]:
    """Yield the recordings."""
    for wheels in (True, False):
        group = f"BROAD, {'with' if wheels else 'without'} wheels"
        for trial in BROAD:
            for axis in "yx":
                log = broad(data, trial, axis)
                recording = log.recording if wheels else replace(log.recording, wheels=None)
                yield Case(group, f"{trial[:2]}:{axis}", recording, setup_of(log), 0.0)
    for name in UIUC:
        log = uiuc(data, name)
        yield Case("UIUC", name.split("_")[-1], log.recording, setup_of(log), UIUC_SKIP)


def vqf_tilt(corrected: CorrectedTrack, time_constant: float) -> FloatArray:
    """Return the tilt [rad] by VQF from calibrated samples in body axes."""
    gyro, accel = (
        np.column_stack([corrected.field(f"{kind}_{axis}") for axis in "xyz"])
        for kind in ("gyro", "accel")
    )
    period = float(np.mean(np.diff(corrected.stamps))) * 1e-9
    import vqf

    quaternions = vqf.VQF(period, tauAcc=time_constant).updateBatch(gyro, accel)["quat6D"]
    w, x, y, z = quaternions.T
    return np.asarray(tilt_of_quaternion(x, y, z, w), dtype=np.float64)


def own_tilt(
    name: str, values: dict[str, float], corrected: CorrectedTrack, setup: Setup
) -> FloatArray:
    """Return the tilt [rad] by a filter of the package."""
    entry = filter_named(name)
    return run_filter(entry, entry.configure(values), corrected, setup.robot).tilt


def judged(recording: Recording, track: TiltTrack, skip: float) -> Figures:
    """Return the errors of one estimate, as they are and freed of mean and delay."""
    assert recording.reference is not None
    first, delay = int(recording.imu.stamps[0]) + round(skip * 1e9), 0.0
    found = score(track.stamps, track.tilt, Association(recording.reference), first)
    as_is = found.mse_deg2
    for _ in range(_DELAY_STEPS):
        delay = found.delay_s
        shifted = Association(recording.reference, ScoringOptions(reference_delay=delay))
        found = score(track.stamps, track.tilt, shifted, first)
        found = replace(found, delay_s=delay + found.delay_s)
    return Figures(as_is, found.mse_deg2 - found.bias_deg**2)


def row(case: Case) -> dict[str, Figures]:
    """Return the figures of every estimator on one recording."""
    recording, setup = case.recording, case.setup
    corrected = Drive(recording, setup).corrected

    def judge(tilt: FloatArray) -> Figures:
        return judged(recording, TiltTrack(corrected.stamps, tilt), case.skip)

    found = {name: judge(own_tilt(name, {}, corrected, setup)) for name in DEFAULTS}
    tuned = [
        judge(own_tilt("complementary", {"time_constant": time}, corrected, setup))
        for time in TIME_CONSTANTS
    ]
    found["complementary, best"] = _best(tuned)
    if recording.wheels is None:
        by_time = {time: judge(vqf_tilt(corrected, time)) for time in VQF_TIME_CONSTANTS}
        found |= {f"VQF {time:g} s": by_time[time] for time in VQF_SHOWN}
        found["VQF, best"] = _best(list(by_time.values()))
    for name, track in recording.estimators.items():
        found[name] = judged(recording, track, case.skip)
    return found


def _best(figures: list[Figures]) -> Figures:
    return Figures(*(min(kind) for kind in zip(*figures, strict=True)))


def table(groups: dict[str, dict[str, dict[str, Figures]]], kind: str) -> None:
    """Print one kind of figure, with the mean of each group of more than two."""
    names = list(dict.fromkeys(name for g in groups.values() for r in g.values() for name in r))
    print(f"\n{kind}\n\n| | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}")
    for group, rows in groups.items():
        columns = {
            name: [getattr(r[name], kind) for r in rows.values() if name in r] for name in names
        }
        for title, found in rows.items():
            cells = [f"{getattr(found[n], kind):.3f}" if n in found else "" for n in names]
            print(f"| {group} {title} | {' | '.join(cells)} |")
        if len(rows) > 2:
            cells = [f"{np.mean(columns[n]):.4f}" if columns[n] else "" for n in names]
            print(f"| {group}, mean | {' | '.join(cells)} |")


def main(data: Path) -> None:
    """Print both tables."""
    if find_spec("vqf") is None:
        sys.exit("real recordings: vqf is missing: pip install '.[import,peers]'")
    groups: dict[str, dict[str, dict[str, Figures]]] = {}
    for case in cases(data):
        print(f"{case.group} {case.title}", file=sys.stderr, flush=True)
        groups.setdefault(case.group, {})[case.title] = row(case)
    for kind in Figures._fields:
        table(groups, kind)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with the recordings")
    main(parser.parse_args().data)
