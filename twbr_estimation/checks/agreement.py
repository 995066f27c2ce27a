"""Whether wheels, gyro and accelerometer show the same motion, and the likeliest cause if not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..robot import EncoderPlacement, Robot
from ..samples import STANDARD_GRAVITY
from .causes import Cause, as_configured, causes
from .delays import wheel_delay
from .diagnosis import diagnosis
from .evidence import Part
from .finding import Finding, Severity, passed
from .rows import Rows, predicted, rows_of, spread

EXPLAINED = 0.6
"""A cause is believed if it leaves at most this share of the contradiction."""
AGREEING = 0.15
"""What remains below this share of the signals is no contradiction."""
CLEARLY = 0.8
"""A delay is believed if it leaves at most this share of what the best other cause leaves."""
FIXED = ("lever arm", "left wheel wrong", "right wheel wrong")
"""Causes whose ratio may be 0."""
PLACED = 0.75
"""The other placement of the encoder is believed if it leaves at most this share."""
PLACEMENTS = tuple(each.value for each in EncoderPlacement)
LEAST_FORCE = 0.03
"""Signals below this are too small to compare [m/s^2]."""
UNEXPLAINED = 0.8
"""A contradiction above this share of the signals, which no cause explains, is worth a warning."""


def agreement(parts: Sequence[Part], robot: Robot) -> Iterator[Finding]:
    """Yield what the comparison of wheels and IMU shows; one cause at most."""
    rows = rows_of(parts)
    if rows is None or rows.wheels is None:
        yield _skipped("no wheels, or no stretch of 6 s with both")
        return
    if _still(rows):
        yield _skipped("too little motion")
        return
    left = as_configured(rows, robot)
    text = f"gyro, accelerometer and wheels agree; {left:.2g} m/s^2 remain"
    agree = passed("wheels", "motion", text)
    if left < AGREEING * _size(rows, robot):
        yield agree
        return
    finding = _explained(rows, parts, robot, left)
    unexplained = left > UNEXPLAINED * _size(rows, robot)
    yield finding or (_unexplained(left, rows) if unexplained else agree)


def _explained(rows: Rows, parts: Sequence[Part], robot: Robot, left: float) -> Finding | None:
    """Return what the likeliest cause means; None where none is believed, or all is well."""
    known = list(causes(rows, robot))
    best = _likeliest(known, wheel_delay(parts, robot))
    finding = diagnosis(best, robot) if best.misfit <= EXPLAINED * left else None
    if finding is not None:
        return finding
    placement = next(each for each in known if each.name in PLACEMENTS)
    return diagnosis(placement, robot) if placement.misfit <= PLACED * left else None


def _still(rows: Rows) -> bool:
    tilting = max(spread(column) for column in rows.turn.T) * STANDARD_GRAVITY
    return tilting < LEAST_FORCE or rows.wheels is None or not np.any(rows.wheels)


def _size(rows: Rows, robot: Robot) -> float:
    """Return the size of the signals that should cancel [m/s^2]."""
    gyro, wheels = predicted(rows, robot)
    return max(spread(rows.force[:, 0]), min(spread(gyro), spread(wheels)))


def _likeliest(known: Sequence[Cause], delayed: Cause) -> Cause:
    """Return the cause that leaves least; a delay mimics a sign where the motion is a sine."""
    believed = (each for each in known if each.name in FIXED or each.believable)
    # A mirrored wheel is left out as well as it is turned round; the simpler fault wins.
    scaled = min(believed, key=lambda each: each.misfit * (1.3 if "wrong" in each.name else 1.0))
    return delayed if delayed.misfit < CLEARLY * scaled.misfit else scaled


def _skipped(why: str) -> Finding:
    return Finding(Severity.SKIP, "wheels", "motion", f"not compared with the IMU: {why}")


def _unexplained(left: float, rows: Rows) -> Finding:
    return Finding(
        Severity.WARN,
        "wheels",
        "motion",
        f"wheels and IMU contradict each other by {left:.2g} m/s^2 where the accelerometer shows "
        f"{spread(rows.force[:, 0]):.2g} m/s^2, and no single cause explains it: the wheels slip, "
        "the robot is carried, or several things are wrong",
    )
