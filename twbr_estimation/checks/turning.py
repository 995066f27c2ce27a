"""Whether the wheels turn the robot the way the gyro shows: left and right, and the yaw axis."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..calibration.regression import regress
from ..robot import Robot
from .diagnosis import SIGNIFICANT
from .evidence import Part
from .finding import Finding, Severity, passed
from .rows import Rows, rows_of, spread

LEAST_RATE = math.radians(3.0)
"""Yaw rates below this are too little to compare [rad/s]."""
CLEAR_RATE = math.radians(10.0)
"""Yaw rates of the wheels above this are no slip [rad/s]."""
USUAL_TRACK = 0.2
"""Distance of the wheels where it is not configured [m]."""
CONSTANT = 1e-6
"""A rate below this, after the band, is that of a reading that never changes [rad/s]."""
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


def _wheels_turn(rows: Rows, robot: Robot) -> float:
    """Return the usual yaw rate that the wheels show [rad/s]; 0 without two of them."""
    if rows.wheel_rates is None or rows.wheel_rates.shape[1] != 2:
        return 0.0
    ahead = rows.wheel_rates[:, 1] - rows.wheel_rates[:, 0]
    return spread(ahead) * robot.wheel_radius / (robot.track_width or USUAL_TRACK)


def turning(parts: Sequence[Part], robot: Robot, others: Sequence[Finding]) -> Iterator[Finding]:
    """Yield whether the right wheel runs ahead where the gyro shows a turn to the left.

    Args:
        parts: stretches of the recording.
        robot: as configured.
        others: what is known about wheels and IMU; nothing is yielded beside a failure.
    """
    rows = rows_of(parts)
    if rows is None or any(each.severity is Severity.FAIL for each in others):
        return
    turns = _wheels_turn(rows, robot)
    if turns > CLEAR_RATE and np.abs(rows.rate[:, 2]).max() < CONSTANT:
        yield Finding(
            Severity.WARN,
            "gyro",
            "dead axis",
            f"axis z reads nothing while the wheels turn the robot by {math.degrees(turns):.3g} "
            "deg/s: it is dead, or was not recorded; turns then disturb the tilt",
        )
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
