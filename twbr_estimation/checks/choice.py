"""Which single cause explains a contradiction, given what else is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from ..robot import Robot
from .causes import Cause, largest_signal
from .rows import Rows, spread
from .units import of_accelerometer, of_gyro, of_length, of_wheels

FIXED = ("lever arm", "left wheel wrong", "right wheel wrong")
"""Causes whose ratio may be 0."""
CLEARLY = 0.8
"""A delay is believed if it leaves at most this share of what the best other cause leaves."""
UNLIKE = 1.5
"""Two wheels whose accelerations differ by more than this factor are not both wrong alike."""
NEAR = 1.35
"""Two causes that leave the same within this factor cannot be distinguished."""
_CONTRADICTED = 2.5  # what a cause leaves counts this many times where other data contradict it
_RARER = 1.3  # the same of a fault that imitates a simpler one
_UNUSUAL = 1.5  # the same of a factor that is no unit's
_TIE = 1.1


class Known(NamedTuple):
    """What other data show; None where they show nothing."""

    gyro: bool | None = None
    """Whether the gyro turns as far as the reference."""
    sides: bool | None = None
    """Whether the wheels turn the robot the way the gyro's z axis shows."""


UNKNOWN = Known()


class Choice(NamedTuple):
    """The likeliest cause, and another that explains the data about as well."""

    best: Cause
    other: Cause | None
    left: float
    """What the best leaves, as a share of the signals."""


def likeliest(
    causes: Sequence[Cause], delayed: Cause, rows: Rows, robot: Robot, known: Known
) -> Choice:
    """Return the cause that leaves least; a delay mimics a sign where the motion is a sine."""
    most, alike = largest_signal(rows, robot), _alike(rows)
    believed = [each for each in causes if each.name in FIXED or each.believable]
    weighed = sorted(
        ((each.left(most) * _weight(each, known, alike, robot), each) for each in believed),
        key=lambda pair: pair[0],
    )
    least, best = weighed[0]
    if delayed.left(most) < CLEARLY * least:
        return Choice(delayed, None, delayed.left(most))
    near = (
        each
        for left, each in weighed
        if left < NEAR * least and _weight(each, known, alike, robot) < _CONTRADICTED
    )
    other = next((each for each in near if _kind(each) != _kind(best)), None)
    return Choice(best, other, best.left(most))


def _kind(cause: Cause) -> str:
    """Return what is wrong if this is the cause."""
    first = cause.name.partition(" ")[0]
    return {"left": "wheels", "right": "wheels", "wheel": "wheels"}.get(first, first)


def _alike(rows: Rows) -> bool:
    """Return whether both wheels accelerate about equally."""
    if rows.wheels is None or rows.wheels.shape[1] != 2:
        return True
    left, right = (spread(column) for column in rows.wheels.T)
    return max(left, right) < UNLIKE * min(left, right)


def _weight(cause: Cause, known: Known, alike: bool, robot: Robot) -> float:
    """Return by how much what a cause leaves is to be multiplied."""
    weight = _prior(cause, robot)
    if known.gyro is not None and cause.name.startswith(("gyro", "turned")) is known.gyro:
        weight *= _CONTRADICTED
    if cause.name.startswith("turned"):
        weight *= _TIE if known.sides is not False else _CONTRADICTED
    if cause.name == "wheels" and cause.ratio < 0.0 and known.sides:
        weight *= _CONTRADICTED
    if cause.name.endswith("wrong") or (cause.name.endswith("scaled") and alike):
        weight *= _RARER
    if cause.name in ("wheels", "wheel radius") and not alike:
        weight *= _CONTRADICTED
    return weight


def _prior(cause: Cause, robot: Robot) -> float:
    """Return 1 for a sign or the ratio of a unit, more for what is rarer."""
    if cause.ratio == 0.0 or cause.name not in _UNITS:
        return 1.0
    reading = 1.0 / cause.ratio
    if 0.8 < abs(reading) < 1.25:
        return 1.0 if cause.name != "wheel radius" or reading > 0.0 else _UNUSUAL
    name = _UNITS[cause.name](reading, robot)
    weight = 1.0 if name and "full scale" not in name else _UNUSUAL
    return weight if reading > 0.0 else weight * _RARER  # a sign and a scale are two faults


_UNITS: Mapping[str, Callable[[float, Robot], str]] = {
    "gyro": lambda reading, robot: of_gyro(reading),
    "accelerometer": lambda reading, robot: of_accelerometer(reading),
    "wheels": of_wheels,
    "left wheel scaled": of_wheels,
    "right wheel scaled": of_wheels,
    "wheel radius": lambda reading, robot: of_length(reading),
}
