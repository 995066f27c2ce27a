"""Stretches of a recording in which the sensor is held still, whatever the angle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks.blocks import runs_of, white_deviation
from ..recording import FloatArray, Recording

WINDOW = 0.25
"""Readings are averaged over this time [s]."""
HELD_RATE = 0.03
"""Standard deviation of a rate, and change of its mean, that is held [rad/s]."""
HELD_FORCE = 0.3
"""The same of the specific force [m/s^2]."""
LARGEST_BIAS = math.radians(25.0)
"""A larger mean rate is a turn; a gyro's bias is within 20 deg/s [rad/s]."""
SHORTEST = 1.0
"""Shortest stretch that counts [s]."""


@dataclass(frozen=True, slots=True)
class Held:
    """One stretch."""

    begin: int
    """Index of its first reading."""
    end: int
    """Index after its last reading."""
    gyro: FloatArray
    """Mean rate [rad/s], (3,)."""
    accel: FloatArray
    """Mean specific force [m/s^2], (3,)."""


def held(recordings: Sequence[Recording]) -> Iterator[Held]:
    """Yield the stretches of all recordings in which the sensor is held still."""
    for recording in recordings:
        yield from _stretches(recording)


def _stretches(recording: Recording) -> Iterator[Held]:
    imu, dt = recording.imu, recording.dt
    size = max(round(WINDOW / dt), 2) if dt > 0.0 else imu.stamps.size + 1
    count = imu.stamps.size // size
    calm = [_calm(imu.gyro, imu.accel, k * size, (k + 1) * size) for k in range(count)]
    for begin, end in (runs_of(np.array(calm, dtype=bool)) * size).tolist():
        for part in _split(imu.accel, begin, end, size):
            if (part[1] - part[0]) * dt >= SHORTEST:
                inside = slice(*part)
                yield Held(*part, imu.gyro[inside].mean(axis=0), imu.accel[inside].mean(axis=0))


def _split(accel: FloatArray, begin: int, end: int, size: int) -> Iterator[tuple[int, int]]:
    """Yield the parts of a stretch between which the mean force changes."""
    start = begin
    for at in range(begin + size, end, size):
        change = accel[at : at + size].mean(axis=0) - accel[start : start + size].mean(axis=0)
        if np.abs(change).max() > HELD_FORCE:
            yield start, at
            start = at
    yield start, end


def _calm(gyro: FloatArray, accel: FloatArray, begin: int, end: int) -> bool:
    rate, force = gyro[begin:end], accel[begin:end]
    if np.abs(rate.mean(axis=0)).max() > LARGEST_BIAS:
        return False
    limits = (
        np.maximum(HELD_RATE, 1.5 * white_deviation(rate)),
        np.maximum(HELD_FORCE, 1.5 * white_deviation(force)),
    )
    return bool((rate.std(axis=0) < limits[0]).all() and (force.std(axis=0) < limits[1]).all())
