"""What a robot at rest shows: noise against the data sheet, and whether calibration is needed."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..recording import FloatArray, Recording
from ..robot import Setup
from ..samples import RESTART_GAP
from .blocks import white_deviation
from .evidence import calibrated
from .finding import Finding, Severity, passed

WINDOW = 0.5
"""Readings are searched for rest over this time [s]."""
LEAST_WINDOWS = 4
"""Fewest windows at rest that are judged."""
REST_RATE = 0.03
"""Standard deviation of the rates that is rest [rad/s]."""
REST_FORCE = 0.3
"""The same of the specific force [m/s^2]."""
REST_WHEEL = 0.02
"""Turn of a wheel that is rest [rad]."""
NEIGHBOURS = 4
"""Windows in a row that must be at rest."""
GYRO_NOISE = math.radians(0.5)
"""Noise of one reading that no MPU6050 has: five times its 0.1 deg/s at full bandwidth [rad/s]."""
ACCEL_NOISE = 0.3
"""The same of the accelerometer: five times 0.06 m/s^2 at full bandwidth [m/s^2]."""
UPRIGHT = 0.7
"""The mean force of a robot that stays upright is at least this share of its mean length."""
YAW_SHARE = 0.5
"""A sensor that is not quite upright sees less of the robot's turns in its pitch rate."""
REMAINING_BIAS = math.radians(0.5)
"""Mean rate at rest that is worth a calibration [rad/s]."""


def rest(recording: Recording, setup: Setup) -> Iterator[Finding]:
    """Yield what the windows at rest show."""
    rate, force = calibrated(recording.imu, setup)
    still = _still(recording, rate, force)
    if len(still) < LEAST_WINDOWS:
        text = "noise and bias are not known: there is no second at rest"
        yield Finding(Severity.SKIP, "IMU", "noise", text)
        yield from _turning_on(recording, rate, force)
        return
    gyro, accel = (_noise(values, still) for values in (rate, force))
    shown = f"{math.degrees(gyro):.3g} deg/s and {accel:.3g} m/s^2 a reading"
    if gyro > GYRO_NOISE or accel > ACCEL_NOISE:
        yield Finding(
            Severity.WARN,
            "IMU",
            "noise",
            f"noise at rest is {shown}, an MPU6050's is within "
            f"{math.degrees(GYRO_NOISE):.2g} deg/s and {ACCEL_NOISE:.2g} m/s^2: vibration, or "
            "another unit",
            max(gyro / GYRO_NOISE, accel / ACCEL_NOISE),
        )
    else:
        yield passed("IMU", "noise", f"noise at rest is {shown}")
    yield _bias(np.concatenate([rate[begin:end] for begin, end in still]))


def _turning_on(recording: Recording, rate: FloatArray, force: FloatArray) -> Iterator[Finding]:
    """Yield a pitch rate that would turn over a robot whose gravity stays on one axis."""
    steps = np.diff(recording.imu.stamps, append=recording.imu.stamps[-1:]) * 1e-9
    steps[steps > RESTART_GAP] = 0.0
    turned, seconds = rate.T @ steps, float(steps.sum())
    mean = np.linalg.norm(np.mean(force, axis=0))
    upright = mean > UPRIGHT * float(np.mean(np.linalg.norm(force, axis=1)))
    if not upright or abs(turned[1]) < max(2.0 * math.pi, YAW_SHARE * abs(turned[2])):
        return
    bias = math.degrees(turned[1] / seconds)
    yield Finding(
        Severity.WARN,
        "gyro",
        "bias",
        f"its pitch rate is {bias:.3g} deg/s in the mean of {seconds:.0f} s, {turned[1]:.3g} rad "
        "in all, although gravity stays on one axis: calibrate it with the robot at rest",
        math.radians(abs(bias)) / REMAINING_BIAS,
        "calibration.gyro_bias",
    )


def _still(recording: Recording, rate: FloatArray, force: FloatArray) -> list[tuple[int, int]]:
    """Return begin and end of every window at rest, with `NEIGHBOURS` at rest around it."""
    size = max(round(WINDOW / recording.dt), 4) if recording.dt > 0.0 else 0
    if size == 0:
        return []
    windows = [(begin, begin + size) for begin in range(0, rate.shape[0] - size + 1, size)]
    wheels = _wheels(recording)
    calm = np.array(
        [
            _calm(rate[begin:end], REST_RATE)
            and _calm(force[begin:end], REST_FORCE)
            and np.ptp(wheels[begin:end], axis=0).max() < REST_WHEEL
            for begin, end in windows
        ],
        dtype=np.float64,
    )
    if calm.size < NEIGHBOURS:
        return []
    runs = np.convolve(calm, np.ones(NEIGHBOURS), "valid") == NEIGHBOURS
    kept = np.convolve(runs, np.ones(NEIGHBOURS)) > 0
    return [window for window, keep in zip(windows, kept, strict=True) if keep]


def _wheels(recording: Recording) -> FloatArray:
    """Return the encoder angles at the IMU's stamps, (n, w); zeros without wheels."""
    stamps, track = recording.imu.stamps, recording.wheels
    if track is None or track.stamps.size == 0:
        return np.zeros((stamps.size, 1))
    return np.column_stack([np.interp(stamps, track.stamps, each) for each in track.angle.T])


def _calm(values: FloatArray, limit: float) -> bool:
    """Return whether readings (n, 3) change by little more than noise."""
    halves = np.abs(values[: len(values) // 2].mean(axis=0) - values[len(values) // 2 :].mean(0))
    return bool(values.std(axis=0).max() < max(limit, 1.5 * _white(values))) and bool(
        halves.max() < 0.5 * limit
    )


def _white(values: FloatArray) -> float:
    """Return the largest white noise of an axis."""
    return float(white_deviation(values).max())


def _noise(values: FloatArray, still: list[tuple[int, int]]) -> float:
    return float(np.median([_white(values[begin:end]) for begin, end in still]))


def _bias(rates: FloatArray) -> Finding:
    largest = float(np.abs(np.median(rates, axis=0)).max())
    text = f"at rest it reads {math.degrees(largest):.2g} deg/s after calibration"
    if largest > REMAINING_BIAS:
        return Finding(
            Severity.WARN,
            "gyro",
            "bias",
            f"{text}: calibrate it with the robot at rest",
            largest / REMAINING_BIAS,
            "calibration.gyro_bias",
        )
    return passed("gyro", "bias", text)
