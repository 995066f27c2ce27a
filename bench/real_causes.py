"""What limits `ins_odometer` on real recordings: one cause undone at a time.

    pip install .[import,peers]
    python bench/real_causes.py DATA

No sensor on board measures what is undone here: the errors of gyro and accelerometer are taken from
the reference, over the very motion that is scored. DATA is that of `real_recordings.py`; figures
are mean square errors [deg^2] and, in brackets, the mean error [deg].
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from real_recordings import BROAD, UIUC, UIUC_SKIP, broad, own_tilt, setup_of, uiuc
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from twbr_estimation.calibration.geometry import WIDTH
from twbr_estimation.calibration.gyro_scale import fit_gyro
from twbr_estimation.calibration.signals import signals_of
from twbr_estimation.drives import Drive
from twbr_estimation.imports.broad import BODY_AXES
from twbr_estimation.imports.matlab import matlab_variables
from twbr_estimation.recording import FloatArray, Recording
from twbr_estimation.robot import Setup
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.scoring.score import Association, Score, score

DATASHEET_DELAY = 0.00098
"""Delay of an MPU6050's gyro without its low-pass [s]."""
CUTOFF = 6.0
"""Below this the cameras' positions can be differentiated twice [Hz]."""
COMPLEMENTARY = {"slow": 0.5, "medium": 0.15}
"""Time constants of the complementary filter that suit the UIUC files best [s]."""

Undo = Callable[[Setup], Setup]


def without_delay(setup: Setup) -> Setup:
    """Set the delay of a gyro without low-pass instead of this one's."""
    return replace(setup, robot=replace(setup.robot, gyro_delay=DATASHEET_DELAY))


def seen_by_cameras(data: Path, trial: str) -> tuple[FloatArray, FloatArray]:
    """Return what gyro [rad/s] and accelerometer [m/s^2] read too much while moving, (3,) each."""
    names = ("imu_gyr", "imu_acc", "opt_quat", "opt_pos", "movement", "sampling_rate")
    read = matlab_variables(data / "broad_translation" / f"{trial}.mat", names)
    rate, moving = float(read["sampling_rate"]), read["movement"] > 0.5
    columns = np.column_stack([read["opt_quat"], read["opt_pos"]])
    known = np.all(np.isfinite(columns), axis=1)
    index = np.arange(known.size)
    filled = np.column_stack([np.interp(index, index[known], c[known]) for c in columns.T])
    attitude = Rotation.from_quat(np.roll(filled[:, :4], -1, axis=1))
    low = butter(2, CUTOFF, fs=rate, output="sos")
    velocity = np.gradient(sosfiltfilt(low, filled[:, 4:], axis=0), axis=0) * rate
    acceleration = np.gradient(velocity, axis=0) * rate
    force = sosfiltfilt(low, attitude.apply(read["imu_acc"]), axis=0)
    surplus = force - acceleration - np.array([0.0, 0.0, STANDARD_GRAVITY])
    turning = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * rate
    middle = 0.5 * (read["imu_gyr"][1:] + read["imu_gyr"][:-1])
    use, both = moving & known, (moving & known)[1:] & (moving & known)[:-1]
    accel = attitude.inv().apply(surplus)[use].mean(axis=0)
    return (middle - turning)[both].mean(axis=0), np.asarray(accel)


def broad_causes(data: Path, trial: str, axis: str) -> dict[str, Undo]:
    """Return what to undo in a hand-held trial, by name."""
    gyro, accel = (BODY_AXES[axis] @ error for error in seen_by_cameras(data, trial))

    def still(setup: Setup) -> Setup:
        return replace(setup, calibration=replace(setup.calibration, gyro_bias=tuple(gyro)))

    def level(setup: Setup) -> Setup:
        return replace(setup, calibration=replace(setup.calibration, accel_bias=tuple(accel)))

    return {
        "as it is": lambda setup: setup,
        "delay untold": without_delay,
        "gyro bias of the motion": still,
        "accelerometer bias of the motion": level,
        "both biases": lambda setup: level(still(setup)),
    }


def uiuc_causes(recording: Recording, setup: Setup) -> dict[str, Undo]:
    """Return what to undo on the motor shaft, by name: the encoder shows gain, bias and scale."""
    assert recording.reference is not None
    gain = fit_gyro([signals_of(Drive(recording, setup))], WIDTH).gain
    tilt, known = Association(recording.reference).at(recording.imu.stamps)
    accel, ones = recording.imu.accel[known], np.ones(int(known.sum()))
    gravity = STANDARD_GRAVITY
    fits = (
        np.linalg.lstsq(np.column_stack([wave, ones]), reading, rcond=None)[0]
        for wave, reading in (
            (-gravity * np.sin(tilt[known]), accel[:, 0]),
            (gravity * np.cos(tilt[known]), accel[:, 2]),
        )
    )
    (scale_x, bias_x), (scale_z, bias_z) = fits

    def gyro(setup: Setup) -> Setup:
        return replace(setup, calibration=replace(setup.calibration, gyro_scale=(1.0, gain, 1.0)))

    def calibrated(setup: Setup) -> Setup:
        calibration = replace(
            setup.calibration,
            accel_bias=(bias_x, 0.0, bias_z),
            accel_scale_x=(1.0 - 1.0 / scale_x,),
            accel_scale_z=(1.0 - 1.0 / scale_z,),
            accel_valid_z=(-11.0, 11.0),
            accel_valid_x=(-11.0, 11.0),
        )
        return replace(setup, calibration=calibration)

    return {
        "as it is": lambda setup: setup,
        "delay untold": without_delay,
        "gyro gain": gyro,
        "accelerometer bias and scale": calibrated,
        "all three": lambda setup: calibrated(gyro(setup)),
    }


def judged(
    recording: Recording, setup: Setup, skip: float, name: str, values: dict[str, float]
) -> Score:
    """Return one filter's errors on one recording."""
    assert recording.reference is not None
    corrected = Drive(recording, setup).corrected
    tilt = own_tilt(name, values, corrected, setup)
    first = int(recording.imu.stamps[0]) + round(skip * 1e9)
    return score(corrected.stamps, tilt, Association(recording.reference), first)


def broad_table(data: Path) -> None:
    """Print the causes in hand-held motion, without wheels."""
    rows: dict[str, list[Score]] = {}
    for trial in BROAD:
        for axis in "yx":
            log = broad(data, trial, axis)
            recording, setup = replace(log.recording, wheels=None), setup_of(log)
            for cause, undo in broad_causes(data, trial, axis).items():
                found = judged(recording, undo(setup), 0.0, "ins_odometer", {})
                rows.setdefault(cause, []).append(found)
    titles = [f"{trial[:2]}:{axis}" for trial in BROAD for axis in "yx"]
    print(f"| BROAD without wheels | mean | {' | '.join(titles)} |\n|{'---|' * (len(titles) + 2)}")
    for cause, scores in rows.items():
        cells = [f"{each.mse_deg2:.3f} ({each.bias_deg:+.2f})" for each in scores]
        mean = np.mean([each.mse_deg2 for each in scores])
        print(f"| {cause} | {mean:.4f} | {' | '.join(cells)} |")


def uiuc_table(data: Path) -> None:
    """Print the causes on the motor shaft."""
    for file in UIUC:
        log, speed = uiuc(data, file), file.split("_")[-1]
        tuned = {"time_constant": COMPLEMENTARY[speed]}
        print(f"\n| UIUC {speed} | ins_odometer | complementary, best as it is |\n|---|---|---|")
        for cause, undo in uiuc_causes(log.recording, setup_of(log)).items():
            setup = undo(setup_of(log))
            scores = (
                judged(log.recording, setup, UIUC_SKIP, name, values)
                for name, values in (("ins_odometer", {}), ("complementary", tuned))
            )
            cells = [f"{each.mse_deg2:.3f} ({each.bias_deg:+.2f})" for each in scores]
            print(f"| {cause} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    broad_table(Path(sys.argv[1]))
    uiuc_table(Path(sys.argv[1]))
