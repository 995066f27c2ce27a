"""Scale of the gyro from whole turns by hand, between two rests or as a whole recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..errors import CalibrationError
from ..recording import FloatArray, Recording
from ..robot import Setup
from .findings import RATIO, CalibrationFinding, Findings
from .held import Held, held

ALIGNED = math.radians(3.0)
"""Standard uncertainty of where a hand ends its turns [rad]."""
DRIFT = math.radians(0.02)
"""Standard uncertainty of the bias between the rests [rad/s]."""
LARGEST_SCALE_ERROR = 0.2
"""A scale further from 1 is another unit, or no whole turn."""
END = 0.5
"""Time at either end whose pose is compared [s]."""
SAME_POSE = math.radians(15.0)
"""Largest angle between the poses at both ends [rad]."""
LEAST_TURN = 0.75
"""Fewer turns than this are not counted as turns."""
LEAST_SHARE = 0.6
"""Least net turn about one axis over all turning, to and fro and about every axis, that is a
turn by hand; a drive has less."""
ACROSS = 0.5
"""Least share of gravity across the axis that is looked at."""
BEYOND = 1.05
"""Readings further beyond the full scale are in another unit."""


@dataclass(frozen=True, slots=True)
class Turned:
    """Turns about one axis of the sensor."""

    axis: int
    angle: float
    """By the gyro, free of bias [rad]."""
    duration: float
    """[s]."""
    share: float
    """Net angle over the angle of all motion, to and fro and about every axis."""
    fastest: float
    """Largest reading about the axis [rad/s]."""
    least_gravity: float
    """Least of gravity's part across the axis over that at the start: below 0 once half a turn is
    made; 0 where gravity lies along the axis."""


def turned(recording: Recording, setup: Setup) -> Turned:
    """Return the longest turn between two rests; without rests, that of the whole recording.

    Raises:
        CalibrationError: no whole turn, or a recording that ends in another pose.
    """
    rests = list(held([recording]))
    if len(rests) < 2:
        rests = _ends(recording, setup)
    found = [_between(recording, *pair) for pair in pairwise(rests)]
    best = max(found, key=lambda each: abs(each.angle))
    if abs(best.angle) < LEAST_TURN * 2.0 * math.pi:
        raise CalibrationError(
            f"{recording.source}: the largest turn between two rests is "
            f"{math.degrees(abs(best.angle)):.0f} deg, whole turns are needed"
        )
    if best.share < LEAST_SHARE:
        raise CalibrationError(
            f"{recording.source}: only {100.0 * best.share:.0f} % of the motion is one turn "
            f"about {'xyz'[best.axis]}, at least {100.0 * LEAST_SHARE:.0f} % are needed: "
            "turn the robot by hand about one axis, whole turns; a drive "
            "does not show how far it turned"
        )
    return best


def _ends(recording: Recording, setup: Setup) -> list[Held]:
    """Return both ends of a recording held in the hand, its bias as configured.

    Raises:
        CalibrationError: the poses at both ends differ.
    """
    imu = recording.imu
    size = max(round(END / recording.dt), 2) if recording.dt > 0.0 else 2
    if imu.stamps.size < 3 * size:
        raise CalibrationError(f"{recording.source}: {recording.duration:.1f} s hold no turn")
    first, last = imu.accel[:size].mean(axis=0), imu.accel[-size:].mean(axis=0)
    cosine = float(first @ last) / float(np.linalg.norm(first) * np.linalg.norm(last) + 1e-9)
    if cosine < math.cos(SAME_POSE):
        raise CalibrationError(
            f"{recording.source}: it ends {math.degrees(math.acos(max(cosine, -1.0))):.0f} deg "
            f"from where it starts, whole turns end within {math.degrees(SAME_POSE):.0f} deg"
        )
    bias = np.array(setup.calibration.gyro_bias)
    count = imu.stamps.size
    return [Held(0, 1, bias, first), Held(count - 1, count, bias, last)]


def _between(recording: Recording, first: Held, last: Held) -> Turned:
    imu, inside = recording.imu, slice(first.end - 1, last.begin + 1)
    times = (imu.stamps[inside] - imu.stamps[first.end - 1]) * 1e-9
    share = (times / max(float(times[-1]), 1e-9))[:, None]
    rate: FloatArray = imu.gyro[inside] - (first.gyro + share * (last.gyro - first.gyro))
    steps = np.diff(times)[:, None]
    angle = np.sum(0.5 * (rate[1:] + rate[:-1]) * steps, axis=0)
    axis = int(np.argmax(np.abs(angle)))
    path = float(np.sum(np.linalg.norm(0.5 * (rate[1:] + rate[:-1]), axis=1) * steps[:, 0]))
    share = abs(float(angle[axis])) / max(path, 1e-30)
    fastest = float(np.abs(imu.gyro[inside, axis]).max())
    least = _least_gravity(imu.accel[inside], first.accel, axis)
    return Turned(axis, float(angle[axis]), float(times[-1]), share, fastest, least)


def _least_gravity(accel: FloatArray, start: FloatArray, axis: int) -> float:
    """Return `Turned.least_gravity` from the forces of a turn, (n, 3), and that before it, (3,)."""
    across = np.where(np.arange(3) == axis, 0.0, start)
    length = float(np.linalg.norm(across))
    if length < ACROSS * float(np.linalg.norm(start)):
        return 0.0
    return float(np.min(accel @ across)) / length**2


def calibrate_turns(
    recordings: Sequence[Recording], setup: Setup, turns: float | None = None
) -> Findings:
    """Estimate the gyro's scale of each axis that was turned, sensor axes.

    Args:
        recordings: one axis each: rest, whole turns, rest in the pose of the start.
        setup: what is replaced.
        turns: how many turns were made; None takes the nearest whole number.

    Raises:
        CalibrationError: no turn, or a scale that is not plausible.
    """
    scale, found = list(setup.calibration.gyro_scale), []
    for recording in recordings:
        each = turned(recording, setup)
        name = "xyz"[each.axis]
        _require_gravity_turns(recording.source, each)
        if turns is None:
            _require_in_range(recording.source, each, setup.robot.gyro_range)
        count = abs(turns) if turns is not None else float(round(abs(each.angle) / math.tau))
        ratio = count * math.tau / abs(each.angle)
        if abs(ratio - 1.0) > LARGEST_SCALE_ERROR:
            raise CalibrationError(
                f"{recording.source}: gyro {name} turns {abs(each.angle) / math.tau:.3g} times "
                f"where {count:g} were made: scale {ratio:.3g} is not plausible; check its unit "
                "(rad/s) and the number of turns"
            )
        error = math.hypot(math.sqrt(2.0) * ALIGNED, DRIFT * each.duration) / abs(each.angle)
        before = setup.calibration.gyro_scale[each.axis]
        note = f"{count:g} turns in {each.duration:.1f} s"
        found.append(CalibrationFinding(f"gyro scale {name}", RATIO, before, ratio, error, note))
        scale[each.axis] = ratio
    x, y, z = scale
    calibration = replace(setup.calibration, gyro_scale=(x, y, z))
    return Findings(replace(setup, calibration=calibration), tuple(found))


def _require_in_range(source: str, each: Turned, gyro_range: float) -> None:
    """Refuse readings in another unit, of which any number of turns is near a whole one."""
    if each.fastest > BEYOND * gyro_range:
        raise CalibrationError(
            f"{source}: gyro {'xyz'[each.axis]} reads up to {each.fastest:.3g} rad/s, beyond "
            f"robot.gyro_range {gyro_range:.3g}: check its unit (rad/s), set robot.gyro_range to "
            "the sensor's full scale, or give the number of turns as `turns`"
        )


def _require_gravity_turns(source: str, each: Turned) -> None:
    """Refuse a turn about a level axis in which gravity does not turn round."""
    if each.least_gravity > 0.0:
        raise CalibrationError(
            f"{source}: gyro {'xyz'[each.axis]} turns {abs(each.angle) / math.tau:.3g} times while "
            "the accelerometer shows no half turn: check the gyro's unit (rad/s) and "
            "calibration.gyro_bias"
        )
