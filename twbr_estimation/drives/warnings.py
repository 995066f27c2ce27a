"""What a user should know before trusting figures of one recording and these settings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..filters import Filter
from ..pipeline.saturation import SATURATION_MARGIN
from ..recording import FloatArray, Recording
from ..robot import Setup
from ..scoring.plausibility import doubts

if TYPE_CHECKING:
    from .drive import Drive

NOTEWORTHY_SATURATION = 0.001
"""A larger share of saturated samples is worth a warning."""


def warnings_for(
    drive: Drive, entries: Iterable[Filter], values: Mapping[str, Mapping[str, float]]
) -> Iterator[str]:
    """Yield the warnings about settings, saturation, units and signs.

    Args:
        drive: the recording with its settings.
        entries: the filters that run.
        values: parameter values in force by filter name.
    """
    chosen = list(entries)
    yield from drive.settings.warnings(drive.dt, chosen)
    for entry in chosen:
        yield from entry.warnings(entry.configure(values[entry.name]), drive.dt)
    yield from _saturation_warnings(drive.recording, drive.setup)
    yield from doubts(drive.recording, drive.setup)


def _saturation_warnings(recording: Recording, setup: Setup) -> Iterator[str]:
    robot, imu = setup.robot, recording.imu
    for name, values, limit in (
        ("gyro", imu.gyro, robot.gyro_range),
        ("accelerometer", imu.accel, robot.accel_range),
    ):
        share = saturated_share(values, limit)
        if share > NOTEWORTHY_SATURATION:
            yield f"{name}: {100 * share:.2f} % of the samples are saturated"


def saturated_share(values: FloatArray, limit: float) -> float:
    """Return the share of readings (n, 3) with an axis at full scale."""
    return float(np.mean(np.any(np.abs(values) >= SATURATION_MARGIN * limit, axis=1)))
