"""Biases of a robot at rest, and the check that it was at rest.

The gyro bias is the mean rate at rest, Laddach 2022 (8). An accelerometer bias can be
separated from a tilt only if the tilt is known, so a live robot estimates it on request.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ..checks.blocks import BLOCK, Blocks
from ..checks.units import of_accelerometer
from ..errors import CalibrationError, ConfigurationError, MotionError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..pipeline.pairing import SampleTrack
from ..recording import FloatArray
from ..robot import Calibration, Robot
from ..samples import READINGS, STANDARD_GRAVITY, Sample
from ..sensors.error_model import scale_error, unscaled

LARGEST_ACCEL_BIAS = 0.4 * STANDARD_GRAVITY
"""The worst boards are off by this [m/s^2]."""
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class StillnessLimits:
    """What counts as still."""

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

    def __post_init__(self) -> None:
        require_bounds(self)


@dataclass(frozen=True, slots=True)
class StillnessSettings(StillnessLimits):
    """How long a robot must stand still, what counts as still, and what is estimated."""

    duration: Annotated[float, Bounds(0.5, 60.0, "s", "Time the biases are averaged over")] = 2.0
    accelerometer: Annotated[
        bool, Meaning("Whether the accelerometer's biases are estimated, too; needs a known tilt.")
    ] = False
    tilt: Annotated[
        float, Bounds(-math.pi, math.pi, "rad", "The robot's tilt while it stands still")
    ] = 0.0


@dataclass(frozen=True, slots=True)
class Movement:
    """The strongest motion among readings that should be at rest."""

    age: float
    """When, before the last reading [s]."""
    share: float
    """Share of the readings that moved, 0 to 1."""
    size: str
    """How much, and the limit, as text."""


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
        CalibrationError: an accelerometer bias that no board has.
    """
    latest = _latest(SampleTrack.of(samples), settings.duration)
    ages = (latest.stamps[-1] - latest.stamps) * 1e-9
    gyro, accel = latest.fields(*READINGS[:3]), latest.fields(*READINGS[3:])
    wheel = latest.fields("wheel_angle") if latest.field("wheel_count").all() else None
    movement = movement_in(ages, gyro, accel, wheel, settings)
    if movement is not None:
        raise MotionError(f"the robot moved {movement.age:.1f} s ago: {movement.size}")
    gyro_bias = gyro.mean(axis=0)
    calibrated = replace(calibration, gyro_bias=tuple(gyro_bias.tolist()))
    if not settings.accelerometer:
        return calibrated
    bias = accel_bias(accel.mean(axis=0), settings.tilt, calibrated, robot)
    return replace(calibrated, accel_bias=bias)


def accel_bias(reading: FloatArray, tilt: float, calibration: Calibration, robot: Robot) -> Triple:
    """Return the accelerometer biases [m/s^2] that explain mean readings at a known tilt.

    Args:
        reading: mean specific force as the device reports it, (3,).
        tilt: the robot's tilt [rad].
        calibration: its scale polynomials, which are inverted (Laddach 2022 (11)).
        robot: mounting of the sensor.

    Raises:
        CalibrationError: the biases would be larger than those of any board.
    """
    force = specific_force(tilt, robot)
    x, y, z = (
        float(reading[axis]) - unscaled(float(force[axis]), scale_error(calibration, "xyz"[axis]))
        for axis in range(3)
    )
    _require_plausible(reading, force, max(abs(x), abs(y), abs(z)))
    return x, y, z


def _require_plausible(reading: FloatArray, force: FloatArray, largest: float) -> None:
    """Refuse a bias that no board has, with its likely cause."""
    if largest <= LARGEST_ACCEL_BIAS:
        return
    length = float(np.linalg.norm(reading))
    unit = of_accelerometer(length / STANDARD_GRAVITY)
    if unit:
        cause = f"it reads {length:.3g} at rest, so it is in {unit}; give m/s^2"
    elif float(reading @ force) < -0.7 * length * STANDARD_GRAVITY:
        cause = (
            "gravity has the wrong sign: the sensor is upside down (robot.mounting), or the "
            "driver reports gravity instead of the specific force, +g on the axis that points up"
        )
    elif length < 0.3 * STANDARD_GRAVITY:
        cause = f"it reads {length:.3g} m/s^2 at rest: the driver removes gravity"
    else:
        cause = "check the robot's tilt, robot.mounting and the sensor's axes"
    raise CalibrationError(
        f"accelerometer: a bias of {largest:.3g} m/s^2 is not plausible, boards are off by up to "
        f"{LARGEST_ACCEL_BIAS:.3g} m/s^2; {cause}"
    )


def specific_force(tilt: float, robot: Robot) -> FloatArray:
    """Return what an ideal accelerometer at rest reads in sensor axes [m/s^2], (3,)."""
    body = STANDARD_GRAVITY * np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
    force: FloatArray = robot.rotation().T @ body
    return force


def _latest(track: SampleTrack, duration: float) -> SampleTrack:
    """Return the last `duration` seconds; needs that much without a gap."""
    gaps = np.flatnonzero(track.field("dt") > BLOCK)
    track = track.since(int(gaps[-1]) if gaps.size else 0)
    ages = (track.stamps[-1:] - track.stamps) * 1e-9
    if ages.size < 2 or ages[0] < 0.98 * duration:
        covered = float(ages[0]) if ages.size else 0.0
        raise ConfigurationError(
            f"only {covered:.2f} s of readings, {duration:g} s are needed; try again later"
        )
    return track.since(int(np.argmax(ages <= duration)))


def movement_in(
    ages: FloatArray,
    gyro: FloatArray,
    accel: FloatArray,
    wheel: FloatArray | None,
    limits: StillnessLimits,
) -> Movement | None:
    """Return the strongest motion that breaks a limit, or None for a robot at rest.

    Args:
        ages: time before the last reading [s], (n,), falling.
        gyro: rates [rad/s], (n, 3).
        accel: specific force [m/s^2], (n, 3).
        wheel: wheel angles [rad], (n, w), where known.
        limits: what counts as still.
    """
    blocks = Blocks(ages)
    signals = [
        ("rate", gyro, limits.rate_limit, "rad/s"),
        ("acceleration", accel, limits.accel_limit, "m/s^2"),
    ]
    if wheel is not None:
        signals.append(("wheel angle", wheel, limits.wheel_limit, "rad"))
    for what, values, limit, unit in signals:
        away = blocks.away(values, np.median(blocks.means(values), axis=0))
        worst = int(np.argmax(away))
        if away[worst] > limit:
            size = f"{what} {away[worst]:.3g} {unit} away from the rest, limit {limit:g}"
            return Movement(float(blocks.centres[worst]), float(np.mean(away > limit)), size)
    turning = float(np.linalg.norm(gyro.mean(axis=0)))
    if turning > limits.bias_limit:
        size = f"it turns, mean rate {turning:.3g} rad/s, limit {limits.bias_limit:.3g}"
        return Movement(float(ages[0]), 1.0, size)
    return None
