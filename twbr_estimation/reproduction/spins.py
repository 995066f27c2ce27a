"""Sihite 2018, Table III: its estimators on the robot that spins, and ours beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..batch import CorrectedTrack, run_filter
from ..configuration.presets import preset
from ..drives import Drive
from ..filters import filter_named
from ..robot import CorrectionSettings, Setup
from ..simulation.spinning import PERIOD, SpinSensor, spin
from .drives import Plan
from .printed import TABLE_3

YAW_RATES = (0.0, 5.0, 10.0)
"""Columns of Table III [rad/s]."""
SETTLING_SHARE = 1.0 / 3.0
"""Share of a spin that is not scored: the printed filters take ten seconds to settle."""
SENSORS: Mapping[str, SpinSensor] = {
    "15.7 mm off": SpinSensor(),
    "and 0.2 % cross-axis": SpinSensor(gyro_cross_axis=0.002),
    "and 0.012 rad mounting": SpinSensor(gyro_cross_axis=0.002, mounting_error=0.012),
}
"""Errors of the IMU; each entry includes the errors of the one before."""
PLAIN = CorrectionSettings(euler=False, centrifugal=False, wheel=False, yaw=False)
"""The paper's complementary filters take the accelerometer as it is."""


class SpinRow(NamedTuple):
    """One estimator of the table."""

    filter: str
    values: Mapping[str, float]
    printed: str = ""
    """Its row in Table III; none where it is ours."""
    corrected: bool = False
    """Whether it gets the IMU's position, and the correction removes all motion terms."""


def rows() -> dict[str, SpinRow]:
    """Return the estimators by what the table calls them."""
    _, settings = preset("sihite2018", PERIOD)
    lagged, kalman = "complementary_lagged", "kalman_tuned"
    printed = {"printed_yaw_terms": 1.0}
    return {
        "complementary (`complementary_lagged`)": SpinRow(
            lagged, settings.values.get(lagged, {}), "CF"
        ),
        "complementary KF (`kalman_tuned`)": SpinRow(kalman, settings.values[kalman], "CKF"),
        "planar KF (`dynamic_planar`)": SpinRow("dynamic_planar", {}, "planar"),
        "yaw EKF as printed (`dynamic_yaw`)": SpinRow("dynamic_yaw", printed, "yaw"),
        "yaw EKF, right terms (`dynamic_yaw`)": SpinRow("dynamic_yaw", {}),
        "complementary, corrected (`complementary_lagged`)": SpinRow(lagged, {}, corrected=True),
        "calibrating EKF (`dynamic_calibrating`)": SpinRow("dynamic_calibrating", {}),
    }


def table3(plan: Plan) -> dict[str, Any]:
    """Return the rms errors of every estimator, mean and worst of the seeds [rad].

    Args:
        plan: how many spins of each yaw rate, and how long; its world does not matter.
    """
    found: dict[tuple[str, str, float], list[float]] = {}
    for imu, sensor in SENSORS.items():
        for yaw_rate in YAW_RATES:
            for seed in range(1, plan.seeds + 1):
                errors = spin_errors(yaw_rate, sensor, plan.duration, seed)
                for name, error in errors.items():
                    found.setdefault((name, imu, yaw_rate), []).append(error)
    table = [
        {
            "estimator": name,
            "filter": row.filter,
            "printed_rad": list(TABLE_3[row.printed]) if row.printed else None,
            "rig": {
                imu: {
                    "mean_rad": [float(np.mean(found[name, imu, rate])) for rate in YAW_RATES],
                    "worst_rad": [float(np.max(found[name, imu, rate])) for rate in YAW_RATES],
                }
                for imu in SENSORS
            },
        }
        for name, row in rows().items()
    ]
    return {"yaw_rates": list(YAW_RATES), "printed_dmp_rad": list(TABLE_3["DMP"]), "rows": table}


def spin_errors(
    yaw_rate: float, sensor: SpinSensor, duration: float, seed: int
) -> dict[str, float]:
    """Return the rms error of every estimator on one spin, once it has settled [rad]."""
    spun = spin(yaw_rate, sensor, duration, seed)
    recording, reference = spun.recording, spun.recording.reference
    assert reference is not None
    x, y, z = spun.setup.robot.lever_arm
    informed = replace(spun.setup.robot, lever_arm=(x + sensor.offset, y, z))
    setups = {
        False: replace(spun.setup, correction=PLAIN),
        True: replace(spun.setup, robot=informed),
    }
    tracks = {known: Drive(recording, setup).corrected for known, setup in setups.items()}
    first = round(SETTLING_SHARE * reference.tilt.size)
    errors = {}
    for name, row in rows().items():
        known = row.corrected
        error = _tilt(row, tracks[known], setups[known]) - reference.tilt
        errors[name] = float(np.sqrt(np.mean(np.square(error[first:]))))
    return errors


def _tilt(row: SpinRow, corrected: CorrectedTrack, setup: Setup) -> Any:
    entry = filter_named(row.filter)
    return run_filter(entry, entry.configure(row.values), corrected, setup.robot).tilt
