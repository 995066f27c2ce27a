"""Quality of a recording: rate, jitter, gaps, saturation."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks.readings import saturated_share
from ..checks.timing import Timing, timing_of
from ..drives import Runs


@dataclass(frozen=True, slots=True)
class Quality:
    """All streams of a recording, and what its sensors could not show."""

    tracks: tuple[tuple[str, Timing], ...]
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
    present = {name: track for name, track in streams.items() if track is not None}
    return Quality(
        tuple((name, timing_of(track.stamps)) for name, track in present.items()),
        saturated_share(recording.imu.gyro, robot.gyro_range),
        saturated_share(recording.imu.accel, robot.accel_range),
    )
