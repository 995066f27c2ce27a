"""Gyro bias against temperature, from a robot at rest while the chip warms up or cools down."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..errors import CalibrationError, MotionError
from ..recording import FloatArray, Recording
from ..robot import Setup
from .findings import BIAS_SLOPE, RATE, TEMPERATURE, CalibrationFinding, Findings
from .regression import Regression, regress
from .still import triple
from .stillness import StillnessLimits, movement_in

LEAST_RANGE = 3.0
"""Least change of the temperature [K]."""
LEAST_DURATION = 60.0
"""Shortest recording [s]."""
WINDOWS = 60
"""Means that are fitted."""
BLOCKS = 10
"""Runs of means whose errors count as independent."""
WANDER = math.radians(0.01)
"""How much a bias wanders by itself between two ends of a warm-up, standard deviation [rad/s]."""
LARGEST_ERROR = math.radians(0.02)
"""A slope that is known less well is no use [rad/s/K]."""


def calibrate_warmup(recording: Recording, setup: Setup) -> Findings:
    """Estimate how the gyro's biases change with the chip's temperature.

    Args:
        recording: a robot at rest from cold on, with its temperature.
        setup: what is replaced: the biases, their slopes and the temperature they hold at.

    Raises:
        CalibrationError: no temperature, too little change of it, or a slope that is not known.
        MotionError: the robot moved.
    """
    temperature = _temperatures(recording)
    times, means = _means(recording, temperature)
    middle = float(means[:, 3].mean())
    warm = means[:, 3] - middle
    blocks = np.floor(np.arange(times.size) * (BLOCKS / times.size))
    design = np.column_stack([np.ones_like(warm), warm])
    fits = [regress(design, means[:, axis], blocks) for axis in range(3)]
    slopes = np.array([fit.values[1] for fit in fits])
    _require_rest(recording, (temperature - middle)[:, None] * slopes)
    span = float(np.ptp(means[:, 3]))
    errors = [math.hypot(float(fit.errors[1]), WANDER / span) for fit in fits]
    if max(errors) > LARGEST_ERROR:
        raise CalibrationError(
            f"{recording.source}: the slope would be known to {math.degrees(max(errors)):.2g} "
            f"deg/s/K, {math.degrees(LARGEST_ERROR):.2g} is the limit: record longer, from colder"
        )
    calibration = replace(
        setup.calibration,
        gyro_bias=triple(np.array([fit.values[0] for fit in fits])),
        gyro_bias_slope=triple(slopes),
        gyro_bias_temperature=middle,
    )
    found = replace(setup, calibration=calibration)
    return _findings(setup, found, fits, errors, means)


def _temperatures(recording: Recording) -> FloatArray:
    """Return the temperature at each IMU reading [degC], (n,).

    Raises:
        CalibrationError: there is none, or it hardly changes.
    """
    track = recording.temperature
    if track is None or track.stamps.size < 2:
        raise CalibrationError(
            f"{recording.source}: no temperature: record imu/temperature beside imu/data_raw, or "
            "name its column or topic"
        )
    if recording.duration < LEAST_DURATION:
        raise CalibrationError(
            f"{recording.source}: {recording.duration:.1f} s are too short, {LEAST_DURATION:g} s "
            "at rest are needed; ten minutes from cold on are good"
        )
    values: FloatArray = np.interp(recording.imu.stamps, track.stamps, track.temperature)
    low, high = np.quantile(values, [0.01, 0.99])
    if high - low < LEAST_RANGE:
        raise CalibrationError(
            f"{recording.source}: the temperature changes by {high - low:.2g} K, {LEAST_RANGE:g} K "
            "are needed: begin with a cold robot, or warm it with a hair dryer"
        )
    return values


def _means(recording: Recording, temperature: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the middle of each window [s] and its mean gyro and temperature, (w, 4)."""
    stamps = recording.imu.stamps
    times = (stamps - stamps[0]) * 1e-9
    members = np.minimum((times / times[-1] * WINDOWS).astype(np.int64), WINDOWS - 1)
    counts = np.bincount(members, minlength=WINDOWS)
    columns = [*recording.imu.gyro.T, temperature]
    sums = [np.bincount(members, column, minlength=WINDOWS) for column in columns]
    kept = counts > 0
    means = np.stack(sums, axis=1)[kept] / counts[kept, None]
    return (np.arange(WINDOWS)[kept] + 0.5) * float(times[-1]) / WINDOWS, means


def _require_rest(recording: Recording, drift: FloatArray) -> None:
    """Raise where the robot moved; what the temperature does to the gyro is no motion."""
    imu = recording.imu
    ages = (imu.stamps[-1] - imu.stamps) * 1e-9
    limits = StillnessLimits()
    movement = movement_in(ages, imu.gyro - drift, imu.accel, None, limits)
    if movement is not None:
        raise MotionError(
            f"{recording.source}: the robot moved {float(ages[0]) - movement.age:.1f} s after the "
            f"start: {movement.size}"
        )


def _findings(
    before: Setup, after: Setup, fits: list[Regression], errors: list[float], means: FloatArray
) -> Findings:
    old, new = before.calibration, after.calibration
    found = []
    for index, name in enumerate("xyz"):
        bias = float(fits[index].errors[0])
        slope = new.gyro_bias_slope[index]
        slope_before, bias_before = old.gyro_bias_slope[index], old.gyro_bias[index]
        found += [
            CalibrationFinding(f"gyro bias {name}", RATE, bias_before, new.gyro_bias[index], bias),
            CalibrationFinding(
                f"gyro bias slope {name}", BIAS_SLOPE, slope_before, slope, errors[index]
            ),
        ]
    middle = new.gyro_bias_temperature
    found.append(
        CalibrationFinding(
            "temperature of the biases", TEMPERATURE, old.gyro_bias_temperature, middle
        )
    )
    low, high = float(means[:, 3].min()), float(means[:, 3].max())
    remaining = math.degrees(max(fit.deviation for fit in fits))
    notes = (
        f"from {low:.1f} to {high:.1f} degC; a straight line leaves {remaining:.2g} deg/s",
        "applied where imu/temperature comes, and to recordings that hold it",
    )
    figures = {"temperature_range": [low, high], "windows": means.tolist()}
    provenance = {"temperature_low": low, "temperature_high": high}
    return Findings(after, tuple(found), notes, figures, provenance)
