"""Whether the wheels turn the robot the way the gyro shows: left and right, and the yaw axis."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ..calibration.regression import regress
from .diagnosis import SIGNIFICANT
from .evidence import Part
from .finding import Finding, Severity, passed
from .rows import Rows, rows_of, spread

LEAST_RATE = math.radians(3.0)
"""Yaw rates below this are too little to compare [rad/s]."""
EXPLAINED = 0.6
"""The wheels explain the yaw if at most this share of it is left."""


def sides_agree(rows: Rows) -> bool | None:
    """Return whether the wheels turn the robot as the gyro shows; None where it hardly turns."""
    ratio = _turned_ratio(rows)
    return None if ratio is None else ratio > 0.0


def _turned_ratio(rows: Rows) -> float | None:
    """Return the yaw rate over the difference of the wheels' rates; None where not known."""
    if rows.wheel_rates is None or rows.wheel_rates.shape[1] != 2:
        return None
    yaw = rows.rate[:, 2]
    ahead = rows.wheel_rates[:, 1] - rows.wheel_rates[:, 0]
    if spread(yaw) < LEAST_RATE or spread(ahead) == 0.0:
        return None
    fit = regress(ahead[:, None], yaw, rows.blocks)
    ratio, error = float(fit.values[0]), float(fit.errors[0])
    if abs(ratio) < SIGNIFICANT * error or fit.deviation > EXPLAINED * spread(yaw):
        return None
    return ratio


def turning(parts: Sequence[Part], others: Sequence[Finding]) -> Iterator[Finding]:
    """Yield whether the right wheel runs ahead where the gyro shows a turn to the left.

    Args:
        parts: stretches of the recording.
        others: what is known about wheels and IMU; nothing is yielded beside a failure.
    """
    rows = rows_of(parts)
    if rows is None or any(each.severity is Severity.FAIL for each in others):
        return
    ratio = _turned_ratio(rows)
    if ratio is None:
        return
    if ratio > 0.0:
        yield passed("wheels", "sides", "the wheels turn the robot the way the gyro shows")
        return
    yield Finding(
        Severity.FAIL,
        "wheels",
        "sides",
        "they turn the robot to the right where the gyro shows a turn to the left: left and "
        "right are swapped (topics.wheel_joints, the encoders' pins), or the gyro's z axis has "
        "the wrong sign",
        ratio,
        "topics.wheel_joints",
    )
