"""The tilt at which a robot balances, from balancing: the parameter `tilt_offset`.

Over a long time the mean acceleration of a robot that stays in a room is nothing: what the
wheels gained in speed is subtracted, and the mean force shows the mean tilt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..checks.evidence import Part, parts_of
from ..errors import CalibrationError
from ..recording import FloatArray, Recording
from ..robot import Setup
from .findings import ANGLE, CalibrationFinding, Findings

SHORTEST = 20.0
"""Shortest time of balancing [s]."""
BLOCK = 4.0
"""Means over this time count as independent [s]."""
LARGEST_ERROR = math.radians(0.5)
"""A larger standard error is of no use [rad]."""


def calibrate_balance(recordings: Sequence[Recording], setup: Setup) -> Findings:
    """Estimate the mean tilt of a balancing robot.

    Args:
        recordings: balancing on level ground, untouched.
        setup: calibrated accelerometer and mounting.

    Raises:
        CalibrationError: too short, or the robot falls or is carried.
    """
    parts = [part for each in recordings for part in parts_of(each, setup)]
    tilts = np.concatenate([np.empty(0), *(_tilts(part, setup) for part in parts)])
    if tilts.size * BLOCK < SHORTEST:
        raise CalibrationError(
            f"balance: {tilts.size * BLOCK:.0f} s of balancing, {SHORTEST:g} s are needed"
        )
    mean = float(np.mean(tilts))
    error = float(np.std(tilts, ddof=1)) / math.sqrt(tilts.size)
    if error > LARGEST_ERROR:
        raise CalibrationError(
            f"balance: the mean tilt is known to {math.degrees(error):.2g} deg only, "
            f"{math.degrees(LARGEST_ERROR):g} deg are needed: the robot falls, is carried, or "
            "drives on a slope; record longer, or calmer"
        )
    found = CalibrationFinding("balance tilt", ANGLE, None, mean, error, f"tilt_offset: {mean:.5f}")
    note = "tilt_offset is a parameter of filter_node and estimation_node; set it there"
    return Findings(setup, (found,), (note,), {"tilt_offset": mean})


def _tilts(part: Part, setup: Setup) -> FloatArray:
    """Return the mean tilt of each block [rad], the gain in speed removed."""
    size = max(round(BLOCK / part.step), 2)
    starts = np.arange(0, part.time.size - size, size)
    pushed = (part.push[starts + size] - part.push[starts]) / (size * part.step)
    forward = pushed[:, 0]
    if part.wheels is not None:
        turned = part.wheels.mean(axis=1)
        speed = setup.robot.wheel_radius * np.gradient(turned, part.step)
        gained = (speed[starts + size] - speed[starts]) / (size * part.step)
        forward = forward - np.where(np.isfinite(gained), gained, 0.0)
    tilts: FloatArray = np.arctan2(-forward, pushed[:, 2])
    return tilts
