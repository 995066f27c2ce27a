"""Single readings: full scale, axes that do not move, noise against the data sheet."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..pipeline.saturation import SATURATION_MARGIN
from ..recording import FloatArray, ImuTrack
from ..robot import Robot
from ..samples import STANDARD_GRAVITY
from ..sensors.mpu6050_settings import Mpu6050Settings
from .evidence import BEYOND
from .finding import Finding, Severity, passed

NOTEWORTHY_SATURATION = 0.001
"""A larger share of saturated samples is worth a warning."""
GYRO_RANGES = tuple(math.radians(value) for value in (250.0, 500.0, 1000.0, 2000.0))
"""Full scales of the chip's gyro [rad/s]."""
ACCEL_RANGES = tuple(STANDARD_GRAVITY * value for value in (2.0, 4.0, 8.0, 16.0))
"""Full scales of the chip's accelerometer [m/s^2]."""
RANGE_TOLERANCE = 0.01
"""Relative difference between two full scales that is taken for rounding."""
DEAD = ("dead", "dead axis")
"""Names of the checks that find readings which never change."""
RECOMMENDED = {
    "gyro": Mpu6050Settings().gyro_range,
    "accelerometer": Mpu6050Settings().accel_range,
}
"""Full scales that leave room for falls and impacts: those of the driver."""
_NEEDED = {"gyro": (1,), "accelerometer": (0, 2)}  # axes of the sensor that see the tilt
_LEAST = 100  # readings from which an axis without change is dead


def saturated_share(values: FloatArray, limit: float) -> float:
    """Return the share of readings (n, 3) with an axis at full scale."""
    return float(np.mean(np.any(np.abs(values) >= SATURATION_MARGIN * limit, axis=1)))


def readings(imu: ImuTrack, robot: Robot) -> Iterator[Finding]:
    """Yield what single readings show."""
    yield from _sensor("gyro", imu.gyro, "gyro_range", robot.gyro_range, GYRO_RANGES, "rad/s")
    yield from _sensor(
        "accelerometer", imu.accel, "accel_range", robot.accel_range, ACCEL_RANGES, "m/s^2"
    )


def _sensor(
    name: str,
    values: FloatArray,
    parameter: str,
    limit: float,
    ranges: tuple[float, ...],
    unit: str,
) -> Iterator[Finding]:
    beyond = float(np.abs(values).max(initial=0.0))
    share = saturated_share(values, limit)
    larger = next((each for each in ranges if each > 1.5 * limit), limit)
    larger = max(larger, RECOMMENDED[name])
    if beyond > BEYOND * limit:
        yield Finding(
            Severity.WARN if beyond <= ranges[-1] * BEYOND else Severity.FAIL,
            name,
            "full scale",
            f"readings up to {beyond:.4g} {unit} are beyond robot.{parameter}, {limit:.4g} {unit}: "
            f"they must be in {unit}, and the parameter is the range the sensor is set to",
            beyond / limit,
            f"robot.{parameter}",
            next((each for each in ranges if each * BEYOND >= beyond), None),
        )
    elif share > NOTEWORTHY_SATURATION:
        yield Finding(
            Severity.WARN,
            name,
            "saturation",
            f"{100 * share:.2f} % of the samples are saturated; a range of {_shown(larger, unit)} "
            "clips less: set it in driver and parameter alike",
            share,
            f"robot.{parameter}",
            larger,
        )
    else:
        text = f"{100 * share:.2f} % of the samples are saturated"
        if limit < (1.0 - RANGE_TOLERANCE) * RECOMMENDED[name]:
            text += f"; {_shown(RECOMMENDED[name], unit)} leave room for falls"
        yield passed(name, "saturation", text)
    yield from _stuck(name, values)


def _shown(limit: float, unit: str) -> str:
    if unit == "rad/s":
        return f"+-{math.degrees(limit):.0f} deg/s"
    return f"+-{limit / STANDARD_GRAVITY:.0f} g"


def _stuck(name: str, values: FloatArray) -> Iterator[Finding]:
    """Yield the axes that never change; an axis a planar log left out is filled with zeros."""
    if values.shape[0] < _LEAST:
        return
    constant, needed = np.ptp(values, axis=0) == 0.0, np.isin(np.arange(3), _NEEDED[name])
    still = constant & (needed | np.any(values != 0.0, axis=0))
    if not still.any():
        return
    axes = ", ".join("xyz"[axis] for axis in np.flatnonzero(still))
    yield Finding(
        Severity.FAIL if (still & needed).any() else Severity.WARN,
        name,
        "dead" if constant.all() else "dead axis",
        "no axis ever changes: the sensor is dead, or its readings were never filled in"
        if constant.all()
        else f"axis {axes} never changes while the others do: it is dead",
    )
