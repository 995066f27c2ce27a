"""Whether wheels, gyro and accelerometer show the same motion, and the likeliest cause if not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..recording import WheelTrack
from ..robot import EncoderPlacement, Robot
from ..samples import STANDARD_GRAVITY
from .causes import Cause, as_configured, causes, largest_signal
from .choice import Known, likeliest
from .delays import wheel_delay
from .diagnosis import diagnosis
from .evidence import Part
from .finding import Finding, Severity, passed
from .reference import gyro_is_right
from .resolution import acceleration_noise
from .rows import Rows, rows_of, spread
from .signs import undecided, without_wheels
from .slip import slips
from .stretches import stretches
from .turning import sides_agree

EXPLAINED = 0.6
"""A cause is believed if it leaves at most this share of the contradiction."""
AGREEING = 0.15
"""What remains below this share of the signals is no contradiction."""
PLACED = 0.75
"""The other placement of the encoder is believed if it leaves at most this share."""
PLACEMENTS = tuple(each.value for each in EncoderPlacement)
LEAST_FORCE = 0.03
"""Signals below this are too small to compare [m/s^2]."""
UNEXPLAINED = 0.8
"""A contradiction above this share of the signals, which no cause explains, is worth a warning."""
NEARLY_ALL = 0.8
"""Wheels that contradict for a larger share of the time do so in all of it."""
HANDLED = 2.0
"""Limits of slip are this many times larger where the IMU moves up and down as in a hand."""
ABOVE_NOISE = 2.0
"""Wheels are compared where their signal is this many times the noise of their readings."""


def agreement(parts: Sequence[Part], robot: Robot, track: WheelTrack | None) -> Iterator[Finding]:
    """Yield what the comparison of wheels and IMU shows; one cause at most.

    Args:
        parts: stretches of the recording.
        robot: as configured.
        track: readings of the wheels.
    """
    rows = rows_of(parts)
    if rows is None or rows.wheels is None or track is None:
        yield _skipped("no wheels, or no stretch of 6 s with both")
        if rows is not None:
            yield from without_wheels(rows, parts)
        return
    noise = robot.wheel_radius * acceleration_noise(track)
    if reason := _not_comparable(rows, robot, noise):
        yield _skipped(reason)
        return
    known = Known(gyro_is_right(rows), sides_agree(rows))
    configured = as_configured(rows, robot)
    finding, share = None, configured.left()
    if share > AGREEING and configured.misfit > ABOVE_NOISE * noise:
        finding = _explained(rows, parts, robot, configured, known)
        if finding is None and share > UNEXPLAINED:
            finding = _in_part(rows, robot, noise) or _unexplained(configured, rows)
    if finding is not None:
        yield finding
        return
    text = f"gyro, accelerometer and wheels agree; {configured.misfit:.2g} m/s^2 remain"
    yield passed("wheels", "motion", text)
    yield from _rolling(rows, robot, noise)
    yield from undecided(rows, robot, known, max(configured.misfit, noise))


def _in_part(rows: Rows, robot: Robot, noise: float) -> Finding | None:
    """Return when the wheels do not roll, if it is not nearly all of the time."""
    for finding in stretches(rows, robot, noise):
        if finding.severity is Severity.WARN and (finding.ratio or 0.0) < NEARLY_ALL:
            return finding
    return None


def _rolling(rows: Rows, robot: Robot, noise: float) -> Iterator[Finding]:
    """Yield where the wheels do not roll: stretches, short slips, or that it was not looked at."""
    found = list(stretches(rows, robot, noise))
    if any(each.severity is Severity.WARN for each in found):
        return iter(found)
    handled = HANDLED if found else 1.0
    return iter(list(slips(rows, robot, noise, handled)) or found)


def _explained(
    rows: Rows, parts: Sequence[Part], robot: Robot, configured: Cause, known: Known
) -> Finding | None:
    """Return what the likeliest cause means; None where none is believed, or all is well."""
    found = list(causes(rows, robot))
    choice = likeliest(found, wheel_delay(parts, robot), rows, robot, known)
    if choice.left <= EXPLAINED * configured.left(largest_signal(rows, robot)):
        finding = diagnosis(choice.best, robot, known)
        other = None if choice.other is None else diagnosis(choice.other, robot, known)
        if finding is not None:
            return finding if other is None else _or(finding, other)
    placement = next(each for each in found if each.name in PLACEMENTS)
    if placement.misfit <= PLACED * configured.misfit:
        return diagnosis(placement, robot, known)
    return None


def _not_comparable(rows: Rows, robot: Robot, noise: float) -> str:
    """Return why the motion cannot be compared; empty where it can."""
    assert rows.wheels is not None
    tilting = max(spread(column) for column in rows.turn.T) * STANDARD_GRAVITY
    shown = max(spread(column) for column in robot.wheel_radius * rows.wheels.T)
    if not np.any(rows.wheels) or max(tilting, shown) < LEAST_FORCE:
        return "too little motion"
    if shown < ABOVE_NOISE * noise and tilting < ABOVE_NOISE * noise:
        return (
            f"the steps or the noise of the wheels' readings, {noise:.2g} m/s^2, hide the motion, "
            f"{tilting:.2g} m/s^2"
        )
    return ""


def _or(finding: Finding, other: Finding) -> Finding:
    """Return a finding that names another one, which the motion cannot distinguish from it."""
    text = f"{finding.text}. The motion cannot distinguish this from: {other.sentence}"
    return replace(finding, text=text)


def _skipped(why: str) -> Finding:
    return Finding(Severity.SKIP, "wheels", "motion", f"not compared with the IMU: {why}")


def _unexplained(left: Cause, rows: Rows) -> Finding:
    return Finding(
        Severity.WARN,
        "wheels",
        "motion",
        f"wheels and IMU contradict each other by {left.misfit:.2g} m/s^2 where the accelerometer "
        f"shows {spread(rows.force[:, 0]):.2g} m/s^2, and no single cause explains it: the wheels "
        "slip, the robot is carried, or several things are wrong",
        left.left(),
    )
