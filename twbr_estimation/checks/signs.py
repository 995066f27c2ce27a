"""Signs that the motion of a recording does not show, and signs without wheels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..robot import Robot
from ..samples import STANDARD_GRAVITY
from .blocks import window_means
from .choice import Known
from .evidence import Part
from .finding import Finding, Severity
from .rows import Rows, predicted, spread
from .swing import BETTER, BLOCK, FITTING, WINDOW, misfits

CLEARLY = 1.5
"""A wrong sign must leave this many times what the right one leaves, else it is not decided."""
LEAST_TURN = math.radians(3.0)
"""Without wheels, tilting below this shows no sign [rad]."""
ALIKE = 0.8
"""Correlation of gyro and accelerometer from which on they show the same motion."""


def undecided(rows: Rows, robot: Robot, known: Known, left: float) -> Iterator[Finding]:
    """Yield which signs may be wrong although the data agree.

    Args:
        rows: the motion.
        robot: as configured.
        known: what other data show.
        left: what the configuration leaves, at least the noise of the wheels [m/s^2].
    """
    gyro, wheels = predicted(rows, robot)
    force = rows.force[:, 0]
    wrong = {
        "the accelerometer's x axis": -force - gyro - wheels,
        "the gyro's y axis": force + gyro - wheels,
        "the wheels": force - gyro + wheels,
    }
    open_ = [
        name
        for name, misfit in wrong.items()
        if spread(misfit) < CLEARLY * left and not (known.gyro and "gyro" in name)
    ]
    if open_:
        text = (
            f"the motion is too small to decide the sign of {', '.join(open_)}: lean the robot by "
            "10 deg and roll it to and fro by hand"
        )
        yield Finding(Severity.SKIP, "IMU", "signs", text)


def without_wheels(rows: Rows, parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield that gyro and accelerometer turn in opposite directions.

    A balancing robot's own acceleration has the same effect, so the force's length decides.
    """
    turn, lean = rows.turn[:, 1], rows.force[:, 0] / -STANDARD_GRAVITY
    if spread(turn) < LEAST_TURN or spread(lean) < LEAST_TURN:
        return
    alike = float(np.corrcoef(turn, lean)[0, 1])
    if alike > -ALIKE:
        return
    against = "its y axis turns against the accelerometer's x axis"
    if _leans_against_the_gyro(parts):
        text = (
            f"{against}: one of both has the wrong sign; positive is leaning forward, +g is on the "
            "axis that points up; check robot.mounting"
        )
        yield Finding(Severity.FAIL, "gyro", "sign", text, -1.0, "robot.mounting")
    else:
        text = (
            f"{against}, as where the robot's own acceleration is stronger than its leaning; to "
            "decide the sign, lean the robot by 10 deg by hand, or record the wheels"
        )
        yield Finding(Severity.SKIP, "gyro", "sign", text)


def _leans_against_the_gyro(parts: Sequence[Part]) -> bool:
    """Return whether the force keeps its length while it turns against the gyro."""
    both = np.array([each for part in parts for each in _misfits(part)]).reshape(-1, 2)
    given, other = np.sqrt(np.sum(both[both.min(axis=1) < FITTING] ** 2, axis=0))
    return bool(given > BETTER * other)


def _misfits(part: Part) -> Iterator[tuple[float, float]]:
    """Yield the misfits of each `WINDOW` of blocks, with the gyro's sign and with the other."""
    size = max(round(BLOCK / part.step), 1)
    force, turn = window_means(part.force(), size), window_means(part.turn[1:, 1:2], size)
    lean, length = np.arctan2(-force[:, 0], force[:, 2]), np.hypot(force[:, 0], force[:, 2])
    columns = np.stack([np.unwrap(lean), turn[:, 0], length])
    for start in range(0, columns.shape[1] - WINDOW + 1, WINDOW):
        yield misfits(*columns[:, start : start + WINDOW].tolist())
