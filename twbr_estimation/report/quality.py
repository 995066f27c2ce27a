"""How good a recording is: rate, jitter, gaps, saturation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bags.cleaning import GAP_PERIODS
from ..drives import Runs
from ..drives.warnings import saturated_share
from ..recording import StampArray


@dataclass(frozen=True, slots=True)
class TrackQuality:
    """One stream of samples."""

    name: str
    samples: int
    duration: float
    """From first to last sample [s]."""
    rate: float
    """Mean rate [Hz]."""
    period: float
    """Median period [s]."""
    jitter: float
    """Standard deviation of the period without gaps [s]."""
    gaps: int
    """Steps above five median periods."""
    longest_step: float
    """[s]."""


@dataclass(frozen=True, slots=True)
class Quality:
    """All streams of a recording, and what its sensors could not show."""

    tracks: tuple[TrackQuality, ...]
    gyro_saturated: float
    """Share of the samples with a gyro axis at full scale."""
    accel_saturated: float
    """Share of the samples with an accelerometer axis at full scale."""


def quality_of(runs: Runs) -> Quality:
    """Return the quality of a recording."""
    recording, robot = runs.recording, runs.drive.setup.robot
    streams = {
        "IMU": recording.imu,
        "wheels": recording.wheels,
        "reference": recording.reference,
        "temperature": recording.temperature,
        **recording.estimators,
    }
    return Quality(
        tuple(_track(name, track.stamps) for name, track in streams.items() if track is not None),
        saturated_share(recording.imu.gyro, robot.gyro_range),
        saturated_share(recording.imu.accel, robot.accel_range),
    )


def _track(name: str, stamps: StampArray) -> TrackQuality:
    if stamps.size < 2:
        return TrackQuality(name, int(stamps.size), 0.0, 0.0, 0.0, 0.0, 0, 0.0)
    steps = np.diff(stamps) * 1e-9
    median, duration = float(np.median(steps)), float(steps.sum())
    gaps = steps > GAP_PERIODS * median
    return TrackQuality(
        name,
        int(stamps.size),
        duration,
        steps.size / duration,
        median,
        float(steps[~gaps].std()),
        int(gaps.sum()),
        float(steps.max()),
    )
