"""The reference encoder against the gyro, and its own rate."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..calibration.regression import regress
from ..recording import Recording, TiltTrack
from .delays import reference_delay
from .diagnosis import SIGNIFICANT, WARN_RATIO
from .evidence import Part
from .finding import Finding, Severity, passed
from .rows import LEAST_SHARE, Rows, rows_of, spread
from .timing import period_of

LEAST_TILT = math.radians(0.1)
"""Tilting below this is too little to compare [rad]."""
CLEAR_TILT = 5.0 * LEAST_TILT
"""Tilting above this must show in the reference, too [rad]."""
GAIN_LIMITS = (0.5, 2.0)
"""How far the gyro's turn may plausibly be from the reference's, as a ratio."""
CLOCK_MARGIN = 0.05
"""Offset of the reference's stamps that is worth a warning [s]."""
EXPLAINED = 0.5
"""Reference and gyro show the same motion if a factor leaves at most this share of it."""
CLEARLY = 0.7
"""A delay is believed if it leaves at most this share of what a wrong scale leaves."""
LARGEST_OFFSET = math.radians(8.0)
"""Distance of the reference's mean from that of gravity that is worth a warning [rad]."""
SLOW = 1.5
"""A reference this many times slower than the IMU is interpolated for real."""
INTERPOLATION_COST_DEG2 = 0.01
"""A larger error from interpolating the reference is worth a warning [deg^2]."""


def reference(
    recording: Recording, parts: Sequence[Part], others: Sequence[Finding] = ()
) -> Iterator[Finding]:
    """Yield what the reference shows; nothing where there is none.

    Args:
        recording: all of it.
        parts: its stretches without gaps.
        others: what gyro, accelerometer and wheels show about each other.
    """
    track = recording.reference
    if track is None or track.stamps.size < 3:
        return
    apart = _apart(recording, track)
    if apart is not None:
        yield apart
        return
    rows = rows_of(parts)
    if rows is not None and _tilting(rows) and float(np.ptp(track.tilt)) == 0.0:
        text = "its angle never changes while the robot turns: it is dead, or the joint is fixed"
        yield Finding(Severity.FAIL, "reference", "dead", text)
        return
    if rows is None or rows.reference is None or not _moving(rows):
        yield Finding(Severity.SKIP, "reference", "motion", "not compared: too little motion")
    else:
        motion = _motion(rows, parts, others)
        yield motion
        yield from _zero(parts, [*others, motion])
    yield from _interpolation(recording.dt, track)


def _apart(recording: Recording, track: TiltTrack) -> Finding | None:
    """Return that no stamp of the reference lies within those of the IMU."""
    stamps = recording.imu.stamps
    if not stamps.size or (track.stamps[0] <= stamps[-1] and track.stamps[-1] >= stamps[0]):
        return None
    apart = 1e-9 * float(track.stamps[0] - stamps[0])
    text = (
        f"its stamps and the IMU's do not overlap: they begin {apart:+.6g} s apart; the clocks "
        "differ"
    )
    return Finding(Severity.FAIL, "reference", "clock", text, apart)


def _tilting(rows: Rows) -> bool:
    return spread(rows.turn[:, 1]) > LEAST_TILT


def _moving(rows: Rows) -> bool:
    """Return whether the reference moves, or does not although the gyro clearly turns."""
    assert rows.reference is not None
    moving = spread(rows.reference[:, 0]) > LEAST_TILT
    return moving or spread(rows.turn[:, 1]) > CLEAR_TILT


def _zero(parts: Sequence[Part], others: Sequence[Finding]) -> Iterator[Finding]:
    """Yield a reference whose mean is far from the direction of gravity."""
    if any(each.severity is Severity.FAIL for each in others):
        return
    found = [_offset(part) for part in parts if part.reference is not None]
    offsets = np.array([each for each in found if math.isfinite(each)])
    if not offsets.size:
        return
    offset = float(np.median(offsets))
    if abs(offset) > LARGEST_OFFSET:
        text = (
            f"it is {math.degrees(offset):.3g} deg from the tilt that gravity shows in the mean: "
            "its zero is not upright, or robot.mounting has another pitch"
        )
        yield Finding(Severity.WARN, "reference", "zero", text, offset, "robot.mounting")


def _offset(part: Part) -> float:
    """Return the mean of reference minus tilt of the mean force [rad]."""
    assert part.reference is not None
    known = np.isfinite(part.reference[1:])
    if known.mean() < LEAST_SHARE:
        return math.nan
    force = part.force()[known].mean(axis=0)
    tilt = math.atan2(-force[0], force[2])
    away = float(np.mean(np.unwrap(part.reference[1:][known]))) - tilt
    return math.remainder(away, 2.0 * math.pi)


def gyro_is_right(rows: Rows) -> bool | None:
    """Return whether the gyro turns as far as the reference; None where that is not known."""
    if rows.reference is None or spread(rows.reference[:, 0]) < LEAST_TILT:
        return None
    fit = regress(rows.reference[:, :1], rows.turn[:, 1], rows.blocks)
    gain = float(fit.values[0])
    if fit.deviation > EXPLAINED * spread(rows.turn[:, 1]):
        return None
    if 1.0 / WARN_RATIO < gain < WARN_RATIO:
        return True
    return None if GAIN_LIMITS[0] < gain < GAIN_LIMITS[1] else False


def _motion(rows: Rows, parts: Sequence[Part], others: Sequence[Finding]) -> Finding:
    assert rows.reference is not None
    tilt, turn = rows.reference[:, 0], rows.turn[:, 1]
    fit = regress(tilt[:, None], turn, rows.blocks)
    delay = reference_delay(parts)
    clearly = delay.misfit < CLEARLY * min(fit.deviation, spread(turn - tilt))
    if abs(delay.ratio) > CLOCK_MARGIN and clearly:
        direction = "early" if delay.ratio < 0.0 else "late"
        text = f"its stamps are {1e3 * abs(delay.ratio):.0f} ms {direction} against the IMU's"
        return Finding(Severity.WARN, "reference", "clock", text, delay.ratio)
    return _gain(float(fit.values[0]), float(fit.errors[0]), others)


def _gain(gain: float, error: float, others: Sequence[Finding]) -> Finding:
    text = f"the gyro turns {gain:.3g} times as far as the reference"
    if not GAIN_LIMITS[0] < gain < GAIN_LIMITS[1]:
        return _contradiction(text, gain, others)
    off = not 1.0 / WARN_RATIO < gain < WARN_RATIO and abs(gain - 1.0) > SIGNIFICANT * error
    if off:
        return Finding(
            Severity.WARN,
            "reference",
            "scale",
            f"{text}: calibrate the gyro's scale",
            gain,
            "calibration.gyro_scale",
        )
    return passed("reference", "scale", text, gain)


def _contradiction(text: str, gain: float, others: Sequence[Finding]) -> Finding:
    """Return which of gyro and reference contradicts wheels and accelerometer, if it is clear."""
    right = "check units and signs of both (rad/s, rad, positive leaning forward), "
    motion = [each for each in others if each.check == "motion"]
    if any(each.subject == "gyro" and each.severity is Severity.FAIL for each in others):
        advice = "the gyro is wrong, see there"
    elif any(each.check == "mounting" for each in others):
        advice = "the IMU's mounting is wrong, see there"
    elif any(each.severity is Severity.PASS for each in motion):
        advice = (
            "the gyro agrees with wheels and accelerometer, so the reference has the wrong sign, "
            "unit or joint; give rad, positive leaning forward"
        )
    else:
        advice = right + "`robot.mounting` and the topics"
    return Finding(Severity.FAIL, "reference", "scale", f"{text}: {advice}", gain)


def _interpolation(dt: float, track: TiltTrack) -> Iterator[Finding]:
    """Test linear interpolation by predicting each reference sample from its neighbours.

    At the middle of two periods it errs four times as much as in the middle of one, and the
    mean square over a period is 8/15 of that in the middle.
    """
    period, tilt = period_of(track.stamps), np.unwrap(track.tilt)
    if period <= SLOW * dt:
        return
    whole = np.diff(track.stamps) < 1.5e9 * period  # gaps are not interpolated
    residual = (tilt[1:-1] - 0.5 * (tilt[:-2] + tilt[2:]))[whole[1:] & whole[:-1]]
    if not residual.size:
        return
    cost = float(np.mean(np.square(np.degrees(residual)))) / 16.0 * 8.0 / 15.0
    if cost > INTERPOLATION_COST_DEG2:
        yield Finding(
            Severity.WARN,
            "reference",
            "rate",
            f"a reading every {1e3 * period:.3g} ms: interpolating it adds about {cost:.2g} deg^2 "
            "to every MSE, or more where it misses whole swings",
            cost,
        )
