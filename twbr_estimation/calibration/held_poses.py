"""The stretches of a recording at rest at known angles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..checks.blocks import BLOCK, Blocks, runs_of
from ..errors import RecordingError
from ..printing.text import counted
from ..recording import FloatArray, Recording

SETTLED = 0.2
"""Time left out at either end of a pose [s]."""
SHORTEST_POSE = 0.5
"""Shortest pose that counts, ends left out [s]."""
REFERENCE_RATE = 0.03
"""Fastest turn of the reference that counts as held [rad/s]."""
GYRO_RATE = 0.05
"""Largest rate away from the gyro's median while held [rad/s]."""
FEWEST = 5
"""Fewest poses a scale polynomial may rest on."""
SMALLEST_SPAN = math.radians(30.0)
"""Smallest range of angles they must cover [rad]."""


@dataclass(frozen=True, slots=True)
class Poses:
    """Held poses; p poses made of m readings in total."""

    tilt: FloatArray
    """Mean reference tilt of each pose [rad], (p,)."""
    accel: FloatArray
    """Mean reading of each pose in sensor axes [m/s^2], (p, 3)."""
    readings: FloatArray
    """Every reading taken while a pose was held [m/s^2], (m, 3)."""
    pose: FloatArray
    """Which pose each reading belongs to, (m,), integers."""
    resolution: float
    """Smallest step of the reference [rad]."""


def held_poses(recording: Recording) -> Poses:
    """Return the poses a recording holds by its reference encoder.

    Raises:
        RecordingError: no reference, too few poses, or too small a range of angles.
    """
    if recording.reference is None:
        raise RecordingError(f"{recording.source}: poses need a reference encoder, there is none")
    reference, imu = recording.reference, recording.imu
    inside = (imu.stamps >= reference.stamps[0]) & (imu.stamps <= reference.stamps[-1])
    stamps, accel, gyro = imu.stamps[inside], imu.accel[inside], imu.gyro[inside]
    if stamps.size < 2:
        raise RecordingError(f"{recording.source}: IMU and reference do not overlap in time")
    times = (stamps - stamps[0]) * 1e-9
    tilt = np.interp(stamps, reference.stamps, reference.tilt)
    runs = _runs(_held(times, tilt, gyro), times)
    _require_enough(recording.source, [float(tilt[run].mean()) for run in runs])
    sizes = [run.size for run in runs]
    return Poses(
        np.array([tilt[run].mean() for run in runs]),
        np.stack([accel[run].mean(axis=0) for run in runs]),
        accel[np.concatenate(runs)],
        np.repeat(np.arange(len(runs)), sizes),
        _resolution(reference.tilt),
    )


def _resolution(tilt: FloatArray) -> float:
    """Return the smallest step between readings of the reference [rad]."""
    steps = np.abs(np.diff(tilt))
    return float(steps[steps > 0.0].min(initial=math.inf))


def _held(times: FloatArray, tilt: FloatArray, gyro: FloatArray) -> NDArray[np.bool_]:
    """Return for each reading whether the robot is held at that time, (n,)."""
    blocks = Blocks(times)
    angle, rate = blocks.means(tilt), blocks.means(gyro)
    steady = np.ones(angle.size, dtype=bool)
    moves = np.abs(np.diff(angle)) > REFERENCE_RATE * BLOCK * np.diff(blocks.numbers)
    steady[1:] &= ~moves
    steady[:-1] &= ~moves
    if steady.any():
        steady &= blocks.away(gyro, np.median(rate[steady], axis=0)) < GYRO_RATE
    held: NDArray[np.bool_] = steady[blocks.of_reading]
    return held


def _runs(held: NDArray[np.bool_], times: FloatArray) -> list[FloatArray]:
    """Return the indices of each pose, its ends left out."""
    runs = []
    for begin, end in runs_of(held):
        span = times[begin:end]
        kept = (span >= span[0] + SETTLED) & (span <= span[-1] - SETTLED)
        if span[-1] - span[0] >= SHORTEST_POSE + 2.0 * SETTLED:
            runs.append(begin + np.flatnonzero(kept))
    return runs


def _require_enough(source: str, angles: list[float]) -> None:
    if len(angles) < FEWEST:
        raise RecordingError(
            f"{source}: the robot is held at {counted(len(angles), 'angle')}, "
            f"at least {FEWEST} are needed, each for {SHORTEST_POSE + 2.0 * SETTLED:g} s"
        )
    span = max(angles) - min(angles)
    if span < SMALLEST_SPAN:
        raise RecordingError(
            f"{source}: the poses cover {math.degrees(span):.1f} deg, "
            f"at least {math.degrees(SMALLEST_SPAN):.0f} deg are needed"
        )
