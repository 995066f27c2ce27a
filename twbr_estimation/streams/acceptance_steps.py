"""What a person is asked to do with a robot, and what the sensors must show of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..checks.evidence import calibrated
from ..checks.finding import Finding, Severity, passed
from ..checks.rest import rest
from ..checks.units import of_gyro
from ..recording import FloatArray, Recording, WheelTrack
from ..robot import Setup

WHEEL_TURN = 1.5
"""A wheel was turned by hand if its angle changed by this much [rad]."""
OTHER_WHEEL = 0.3
"""Largest turn of the other wheel, as a share of it."""
PAUSE = 0.5
"""Time for which the wheels rest before one is turned [s]."""
PAUSE_TURN = 0.1
"""Turn of a wheel that is rest [rad]."""
HELD = 0.5
"""Rates of the body above this mean that it was moved, and the wheel is judged again [rad/s]."""
LEAN = math.radians(12.0)
"""A lean is judged from here on [rad]."""
LEAN_TIME = 3.0
"""It must happen within this time, so that a gyro bias matters little [s]."""
LEAN_RATE = 0.3
"""Rate below which it is held [rad/s]."""
GYRO_LIMITS = (0.5, 2.0)
"""How far the gyro's turn may plausibly be from the accelerometer's lean, as a ratio."""
_TRIES = 200  # most beginnings of a pause that are looked at
_ENDS = 0.3  # time over which the accelerometer is averaged [s]
_SIDES = ("left", "right")

Judge = Callable[[Recording, Setup], list[Finding]]


class Step(NamedTuple):
    """Something to do, and how it is judged."""

    name: str
    request: str
    """What the person is asked for."""
    judge: Judge
    """Returns what was found since the step began; nothing as long as it has not been done."""


def steps() -> tuple[Step, ...]:
    """Return the steps in their order."""
    return (
        Step("rest", "put the robot down and leave it at rest", _judge_rest),
        Step("left wheel", "turn the left wheel forward, that one only", _wheel(0)),
        Step("right wheel", "turn the right wheel forward, that one only", _wheel(1)),
        Step("lean", "lean the robot forward by about 20 deg and hold it", judge_lean),
    )


def _judge_rest(recording: Recording, setup: Setup) -> list[Finding]:
    found = list(rest(recording, setup))
    return [] if found[0].severity is Severity.SKIP else found


def _wheel(column: int) -> Judge:
    return lambda recording, setup: judge_wheel(recording, setup, column)


def judge_wheel(recording: Recording, setup: Setup, column: int) -> list[Finding]:
    """Judge one wheel turned forward by hand while the body is held.

    Args:
        recording: since the step began.
        setup: as configured.
        column: of the wheel, 0 for left and 1 for right.
    """
    track = recording.wheels
    if track is None:
        return []
    rate, _ = calibrated(recording.imu, setup)
    moved = np.flatnonzero(np.abs(rate).max(axis=1) > HELD)
    held_since = recording.imu.stamps[moved[-1]] if moved.size else track.stamps[0]
    since = _first_pause(track, int(held_since))
    if since is None:
        return []
    turned = track.angle[-1] - track.angle[since]
    if turned.size == 1:
        return _single(float(turned[0])) if abs(turned[0]) > WHEEL_TURN else []
    return _one_of_two(float(turned[column]), float(turned[1 - column]), column)


def _first_pause(track: WheelTrack, after: int) -> int | None:
    """Return the first reading after which the wheels rest; what turned before is another step's.

    Args:
        track: of the wheels.
        after: stamp to begin at [ns].
    """
    begin = int(np.searchsorted(track.stamps, after))
    last = int(np.searchsorted(track.stamps, track.stamps[-1] - round(PAUSE * 1e9)))
    for first in range(begin, last, max((last - begin) // _TRIES, 1)):
        end = int(np.searchsorted(track.stamps, track.stamps[first] + round(PAUSE * 1e9)))
        if np.ptp(track.angle[first : end + 1], axis=0).max() < PAUSE_TURN:
            return first
    return None


def _single(turned: float) -> list[Finding]:
    return [_direction("wheel", turned, [-1])]


def _one_of_two(own: float, other: float, column: int) -> list[Finding]:
    side = _SIDES[column]
    if abs(own) > WHEEL_TURN and abs(other) < OTHER_WHEEL * abs(own):
        return [_direction(f"{side} wheel", own, [-1, 1] if column == 0 else [1, -1])]
    if abs(other) > WHEEL_TURN and abs(own) < OTHER_WHEEL * abs(other):
        text = (
            f"the {side} wheel was to be turned, and the {_SIDES[1 - column]} wheel's angle "
            f"changed by {other:.3g} rad: left and right are swapped, in the wiring or in the "
            "joint names"
        )
        return [Finding(Severity.FAIL, "wheels", "sides", text)]
    return []


def _direction(name: str, turned: float, signs: list[int]) -> Finding:
    text = f"turned forward by hand, the {name} reads {turned:+.3g} rad"
    if turned > 0.0:
        return passed("wheels", "sign", text)
    return Finding(
        Severity.FAIL,
        "wheels",
        "sign",
        f"{text}: it counts backward; change its sign in `signs` of the encoders",
        -1.0,
        "signs",
        signs,
    )


def judge_lean(recording: Recording, setup: Setup) -> list[Finding]:
    """Judge a lean forward that is held: accelerometer against the request, gyro against it.

    Args:
        recording: since the step began.
        setup: as configured.
    """
    stamps = recording.imu.stamps
    chosen = stamps >= stamps[-1] - round(LEAN_TIME * 1e9)
    rate, force = (each[chosen] for each in calibrated(recording.imu, setup))
    times = (stamps[chosen] - stamps[chosen][0]) * 1e-9
    first, last = times <= _ENDS, times >= times[-1] - _ENDS
    if times[-1] < 3.0 * _ENDS or np.abs(rate[last].mean(axis=0)).max() > LEAN_RATE:
        return []
    begin, end = _leans(force[first].mean(axis=0)), _leans(force[last].mean(axis=0))
    pitch, roll = end - begin
    if max(abs(pitch), abs(roll)) < LEAN:
        return []
    wrong = _wrong_lean(float(pitch), float(roll))
    if wrong is not None:
        return [wrong]
    steps_of_time = np.diff(times)[:, None]
    turn = np.sum(0.5 * (rate[1:] + rate[:-1]) * steps_of_time, axis=0)
    lean = f"leaned forward, the accelerometer shows {math.degrees(pitch):.3g} deg"
    return [passed("accelerometer", "lean", lean), _gyro(turn, float(pitch))]


def _leans(force: FloatArray) -> FloatArray:
    """Return the angles about y and x at which gravity gives this specific force [rad]."""
    return np.array([math.atan2(-force[0], force[2]), math.atan2(force[1], force[2])])


def _wrong_lean(pitch: float, roll: float) -> Finding | None:
    if abs(roll) > abs(pitch):
        where = f"a lean of {abs(math.degrees(roll)):.3g} deg to the side: its axes are swapped"
        check = "axes"
    elif pitch < 0.0:
        where = f"a lean of {-math.degrees(pitch):.3g} deg backward: its x axis points backward"
        check = "sign"
    else:
        return None
    return Finding(
        Severity.FAIL,
        "accelerometer",
        check,
        f"the robot was to be leaned forward, and the accelerometer shows {where}, or "
        "robot.mounting does not say how the sensor sits",
        parameter="robot.mounting",
    )


def _gyro(turn: FloatArray, lean: float) -> Finding:
    axis = int(np.argmax(np.abs(turn)))
    ratio = float(turn[axis]) / lean
    shown = f"leaned forward by {math.degrees(lean):.3g} deg, the gyro turns {ratio:.3g} times that"
    if abs(ratio) < GYRO_LIMITS[0]:
        return _gyro_fault("unit", f"{shown}: it is dead, or in another unit than rad/s", ratio)
    if axis != 1:
        text = f"{shown} about {'xyz'[axis]}: its axes are swapped; the lean is about y"
        return _gyro_fault("axes", text, ratio)
    if abs(ratio) > GYRO_LIMITS[1]:
        unit = of_gyro(ratio)
        named = f"; it looks like {unit}" if unit else ""
        return _gyro_fault("unit", f"{shown}{named}: give rad/s", ratio)
    if ratio < 0.0:
        return _gyro_fault("sign", f"{shown}: positive is leaning forward", ratio)
    return passed("gyro", "lean", shown, ratio)


def _gyro_fault(check: str, text: str, ratio: float) -> Finding:
    return Finding(Severity.FAIL, "gyro", check, text, ratio, "robot.mounting")
