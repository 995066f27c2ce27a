"""Biases of a robot that stands still, and the judgement whether it did.

The gyro bias is the mean rate at rest, Laddach 2022 (8). An accelerometer bias can be told
from a tilt only if the tilt is known, so it is estimated on request.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ..bounds import Bounds, require_bounds
from ..errors import ConfigurationError, MotionError
from ..recording import FloatArray
from ..robot import Calibration, Robot
from ..samples import STANDARD_GRAVITY, Sample

BLOCK = 0.1
"""Readings are averaged over this time [s] before they are searched for motion."""


@dataclass(frozen=True, slots=True)
class StillnessSettings:
    """How long a robot must stand still, and what counts as still."""

    duration: Annotated[float, Bounds(0.5, 60.0, "s", "Time the biases are averaged over")] = 2.0
    rate_limit: Annotated[
        float, Bounds(1e-4, 1.0, "rad/s", "Rate away from the mean that counts as motion")
    ] = 0.02
    accel_limit: Annotated[
        float, Bounds(1e-3, 5.0, "m/s^2", "Acceleration away from the mean that counts as motion")
    ] = 0.2
    wheel_limit: Annotated[
        float, Bounds(1e-4, 1.0, "rad", "Turn of the wheels that counts as motion")
    ] = 0.02
    bias_limit: Annotated[
        float,
        Bounds(1e-3, 2.0, "rad/s", "Mean rate no gyro at rest shows; +-20 deg/s for an MPU6050"),
    ] = math.radians(25.0)
    accelerometer: bool = False
    """Whether the accelerometer's biases are estimated, too; needs a known tilt."""
    tilt: Annotated[
        float, Bounds(-math.pi, math.pi, "rad", "The robot's tilt while it stands still")
    ] = 0.0

    def __post_init__(self) -> None:
        require_bounds(self)


def still_calibration(
    samples: Sequence[Sample],
    calibration: Calibration,
    robot: Robot,
    settings: StillnessSettings,
) -> Calibration:
    """Return the calibration with the biases these samples show.

    Args:
        samples: Raw readings, oldest first; the latest `settings.duration` seconds count.
        calibration: Everything that stays, such as the scale polynomials.
        robot: Mounting of the sensor.
        settings: What counts as still.

    Raises:
        ConfigurationError: the samples do not cover the duration.
        MotionError: the robot moved; the message says when and how much.
    """
    rows = np.array(samples, dtype=np.float64).reshape(-1, len(Sample._fields))
    rows = _latest(rows, settings.duration)
    _require_still(rows, settings)
    gyro_bias = rows[:, 1:4].mean(axis=0)
    calibrated = replace(calibration, gyro_bias=tuple(gyro_bias.tolist()))
    if not settings.accelerometer:
        return calibrated
    expected = robot.rotation().T @ (
        STANDARD_GRAVITY * np.array([-math.sin(settings.tilt), 0.0, math.cos(settings.tilt)])
    )
    readings = rows[:, 4:7].mean(axis=0) - expected
    bias = [
        float(readings[axis] - _scale_error(calibration, "xyz"[axis], float(expected[axis])))
        for axis in range(3)
    ]
    return replace(calibrated, accel_bias=(bias[0], bias[1], bias[2]))


def _scale_error(calibration: Calibration, axis: str, expected: float) -> float:
    """Return S(p) with p - S(p) = expected, the inverse of Laddach 2022 (11)."""
    polynomial = (*reversed(getattr(calibration, f"accel_scale_{axis}")), 0.0)
    low, high = getattr(calibration, f"accel_valid_{axis}")
    error = 0.0
    for _ in range(50):
        error = float(np.polyval(polynomial, min(max(expected + error, low), high)))
    return error


def _latest(rows: FloatArray, duration: float) -> FloatArray:
    """Return the rows of the last `duration` seconds; needs that much without a gap."""
    gaps = np.flatnonzero(rows[:, 0] > BLOCK)
    rows = rows[gaps[-1] :] if gaps.size else rows
    ages = np.concatenate([np.cumsum(rows[:0:-1, 0])[::-1], [0.0]]) if len(rows) else rows[:, 0]
    if len(rows) < 2 or ages[0] < 0.98 * duration:
        covered = float(ages[0]) if len(rows) else 0.0
        raise ConfigurationError(
            f"only {covered:.2f} s of readings, {duration:g} s are needed; try again later"
        )
    return rows[ages <= duration]


def _require_still(rows: FloatArray, settings: StillnessSettings) -> None:
    ages = float(rows[1:, 0].sum()) - np.concatenate([[0.0], np.cumsum(rows[1:, 0])])
    blocks = np.floor(ages / BLOCK).astype(np.int64)
    _, members = np.unique(blocks, return_inverse=True)
    weights = np.bincount(members)
    means = np.stack([np.bincount(members, rows[:, k]) / weights for k in range(1, 8)], axis=1)
    known = rows[:, 9] > 0.0
    for what, columns, limit, unit in (
        ("rate", slice(0, 3), settings.rate_limit, "rad/s"),
        ("acceleration", slice(3, 6), settings.accel_limit, "m/s^2"),
        ("wheel angle", slice(6, 7), settings.wheel_limit if known.all() else math.inf, "rad"),
    ):
        away = np.linalg.norm(means[:, columns] - np.median(means[:, columns], axis=0), axis=1)
        worst = int(np.argmax(away))
        if away[worst] > limit:
            raise MotionError(
                f"the robot moved {worst * BLOCK:.1f} s ago: {what} {away[worst]:.3g} {unit} "
                f"away from the rest, limit {limit:g}"
            )
    mean_rate = float(np.linalg.norm(rows[:, 1:4].mean(axis=0)))
    if mean_rate > settings.bias_limit:
        raise MotionError(
            f"the robot turns: mean rate {mean_rate:.3g} rad/s, limit {settings.bias_limit:.3g}"
        )
