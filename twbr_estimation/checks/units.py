"""Ratios that have a name: degrees, turns, the motor's side of a gear, counts of an encoder."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..robot import Robot
from ..samples import STANDARD_GRAVITY

TOLERANCE = 0.12
"""Relative difference up to which a ratio counts as the named one."""
GYRO_COUNTS = (131.0, 65.5, 32.8, 16.4)
"""Counts of the MPU6050 per deg/s, by full scale."""
ACCEL_COUNTS = (16384.0, 8192.0, 4096.0, 2048.0)
"""Counts of the MPU6050 per g, by full scale."""
_FULL_SCALES = {
    "a reading scaled for twice the full scale": 2.0,
    "a reading scaled for a full scale four times as large": 4.0,
    "a reading scaled for a full scale eight times as large": 8.0,
    "a reading scaled for half the full scale": 0.5,
    "a reading scaled for a quarter of the full scale": 0.25,
    "a reading scaled for an eighth of the full scale": 0.125,
}
_LENGTHS = {
    "the distance rolled in m": 1.0,
    "the distance rolled in cm": 1e2,
    "the distance rolled in mm": 1e3,
}
_DEGREES = math.degrees(1.0)


def named(ratio: float, names: Mapping[str, float], tolerance: float = TOLERANCE) -> str:
    """Return the name whose ratio is nearest to `ratio`; empty where none is near."""
    best, distance = "", math.log1p(tolerance)
    for name, value in names.items():
        if ratio == 0.0 or ratio * value <= 0.0:
            continue
        away = abs(math.log(ratio / value))
        if away < distance:
            best, distance = name, away
    return best


def of_wheels(reading: float, robot: Robot) -> str:
    """Return what wheel angles are that read `reading` times the true angle."""
    size = abs(reading)
    names = {
        "degrees": _DEGREES,
        "turns": 0.5 / math.pi,
        "angles on the motor's side of the gear": robot.gear_ratio,
        "those of an encoder counted with four times its resolution": 4.0,
        "those of an encoder counted with a quarter of its resolution": 0.25,
        "those of an encoder counted with twice its resolution": 2.0,
        "those of an encoder counted with half its resolution": 0.5,
    }
    lengths = {unit: robot.wheel_radius * size for unit, size in _LENGTHS.items()}
    name = named(size, names) or named(size, lengths)
    if not name and size > 12.0:
        name = f"counts of an encoder with about {2.0 * math.pi * size:.3g} counts a turn"
    return name


def of_gyro(reading: float, tolerance: float = TOLERANCE) -> str:
    """Return the unit of rates that read about `reading` times the true one."""
    counts = {_counts(size, "deg/s"): _DEGREES * size for size in GYRO_COUNTS}
    units = {"deg/s": _DEGREES, "turns/s": 0.5 / math.pi, "mrad/s": 1e3}
    return named(abs(reading), {**units, **_FULL_SCALES, **counts}, tolerance)


def of_accelerometer(reading: float) -> str:
    """Return the unit of forces that read `reading` times the true one."""
    counts = {_counts(size, "g"): size / STANDARD_GRAVITY for size in ACCEL_COUNTS}
    units = {"g": 1.0 / STANDARD_GRAVITY, "mg": 1e3 / STANDARD_GRAVITY}
    return named(abs(reading), {**units, **counts})


def _counts(size: float, unit: str) -> str:
    return f"the chip's counts, {size:g} to 1 {unit}"


def of_length(configured: float) -> str:
    """Return the unit of a length that is `configured` times the true one."""
    return named(abs(configured), {"mm": 1e3, "cm": 1e2, "inches": 1.0 / 0.0254})
