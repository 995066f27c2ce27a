"""Wheel encoders by themselves: missing, slow, dead, jumping, and their stamps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..pipeline.pairing import pair
from ..printing.text import counted
from ..recording import FloatArray, Recording, WheelTrack
from ..samples import Sample
from .band import banded, clear_of_ends
from .evidence import BoolArray, Part
from .finding import Finding, Severity, passed
from .timing import period_of

WITHOUT_WHEEL = 0.01
"""A larger share of samples without a wheel reading is worth a warning."""
SLOW = 1.5
"""Wheels or reference this many times slower than the IMU are interpolated for real."""
DEAD_TURN = 3.0
"""Turn of the other wheel [rad] during which one that stands still is dead."""
DEAD_TIME = 2.0
"""Time one wheel must stand still for that [s]."""
TILTED = math.radians(1.0)
"""Tilting of the robot during which an encoder that stands still is worth a warning [rad]."""
JUMP = 1.0
"""Least step between two readings that is a jump [rad]."""
FASTEST = 150.0
"""Speed of a wheel above which two readings are a jump apart [rad/s]."""
JUMP_FACTOR = 8.0
"""How many times larger than the largest usual step a jump is."""
SPIKE = 5
"""Readings within which a spike is over."""
_USUAL = 0.9  # quantile
_PROBES = 20_000  # samples looked at for their wheel reading
_SIDES = ("left", "right")


def wheels(recording: Recording, parts: Sequence[Part], needed: bool) -> Iterator[Finding]:
    """Yield what the encoders show without the IMU's motion.

    Args:
        recording: all of it.
        parts: its stretches without gaps.
        needed: whether the correction takes the wheels' acceleration.
    """
    track = recording.wheels
    if track is None or track.stamps.size < 2:
        if needed:
            yield _absent()
        return
    if needed:
        yield from _missing(recording, track)
        yield _rate(recording, track)
    yield from _dead(track, parts)
    yield from _jumps(track)


def _absent() -> Finding:
    return Finding(
        Severity.WARN,
        "wheels",
        "presence",
        "no wheel encoder in the recording: the wheels' acceleration is not removed",
    )


def _missing(recording: Recording, track: WheelTrack) -> Iterator[Finding]:
    imu, thinned = recording.imu, slice(None, None, 1 + recording.imu.stamps.size // _PROBES)
    overlap = min(imu.stamps[-1], track.stamps[-1]) - max(imu.stamps[0], track.stamps[0])
    if overlap <= 0:
        apart = 1e-9 * float(track.stamps[0] - imu.stamps[0])
        yield Finding(
            Severity.FAIL,
            "wheels",
            "clock",
            f"their stamps and the IMU's do not overlap: they begin {apart:+.6g} s apart; the "
            "clocks differ",
            apart,
        )
        return
    probes = replace(
        imu, stamps=imu.stamps[thinned], gyro=imu.gyro[thinned], accel=imu.accel[thinned]
    )
    paired = pair(probes, track).columns
    without = float(np.mean(paired[Sample._fields.index("wheel_count")] == 0.0))
    if without > WITHOUT_WHEEL:
        yield Finding(
            Severity.WARN,
            "wheels",
            "presence",
            f"{100.0 * without:.3g} % of the samples have no wheel reading: the wheels' "
            "acceleration is not removed there",
            without,
        )


def _rate(recording: Recording, track: WheelTrack) -> Finding:
    period = period_of(track.stamps)
    if period > SLOW * recording.dt > 0.0:
        return Finding(
            Severity.WARN,
            "wheels",
            "rate",
            f"readings come every {1e3 * period:.3g} ms, IMU samples every "
            f"{1e3 * recording.dt:.3g} ms: the wheels' acceleration comes in jerks; the motion "
            "terms euler and centrifugal alone leave it out",
            period / recording.dt,
            "correction.wheel",
            False,
        )
    return passed("wheels", "rate", f"readings come every {1e3 * period:.3g} ms")


def dead_wheels(track: WheelTrack) -> tuple[int, ...]:
    """Return the columns of encoders that stand still for the whole recording."""
    return tuple(int(column) for column in np.flatnonzero(np.ptp(track.angle, axis=0) == 0.0))


def _dead(track: WheelTrack, parts: Sequence[Part]) -> Iterator[Finding]:
    dead = dead_wheels(track)
    tilted = max((_tilting(part) for part in parts), default=0.0)
    if len(dead) == track.angle.shape[1]:
        if tilted > TILTED:
            yield Finding(
                Severity.WARN,
                "wheels",
                "dead",
                f"the angle never changes while the robot turns by {math.degrees(tilted):.3g} deg: "
                "the encoder is dead, or the robot was held",
            )
        return
    if track.angle.shape[1] == 2:
        yield from _stands(track)


def _tilting(part: Part) -> float:
    """Return the range of the pitch without what a gyro bias adds to it [rad]."""
    turn = banded(part.turn[:, 1], part.step)[clear_of_ends(part.time.size, part.step)]
    return float(np.ptp(turn)) if turn.size else 0.0


def _stands(track: WheelTrack) -> Iterator[Finding]:
    """Yield a wheel that stands still while the other turns; robust against slip of either."""
    times = (track.stamps - track.stamps[0]) * 1e-9
    for column, side in enumerate(_SIDES):
        stretch = _longest_rest(times, track.angle[:, column], track.angle[:, 1 - column])
        if stretch is None:
            continue
        begin, end, turned = stretch
        yield Finding(
            Severity.FAIL,
            "wheels",
            "dead",
            f"the {side} wheel's angle stays the same from {begin:.1f} s to {end:.1f} s while the "
            f"other turns by {turned:.3g} rad: its encoder or cable is dead",
        )


def _longest_rest(
    times: FloatArray, own: FloatArray, other: FloatArray
) -> tuple[float, float, float] | None:
    """Return begin, end and the other's turn of the stretch of rest with most of it."""
    changes = np.flatnonzero(np.diff(own) != 0.0)
    edges = np.concatenate([[-1], changes, [own.size - 1]])
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(other)))])
    begins, ends = edges[:-1] + 1, edges[1:]
    turned = np.where(times[ends] - times[begins] > DEAD_TIME, path[ends] - path[begins], 0.0)
    most = int(np.argmax(turned))
    if turned[most] < DEAD_TURN:
        return None
    return float(times[begins[most]]), float(times[ends[most]]), float(turned[most])


def _jumps(track: WheelTrack) -> Iterator[Finding]:
    steps = np.diff(track.angle, axis=0)
    size = np.abs(steps)
    least = max(JUMP, FASTEST * period_of(track.stamps))
    usual = np.maximum(np.quantile(size, _USUAL, axis=0) * JUMP_FACTOR, least)
    apart = 1e-9 * np.diff(track.stamps)[:, None]
    jumping = size > np.maximum(usual, FASTEST * apart)  # a wheel turns on in a hole of the data
    count = int(np.sum(jumping.any(axis=1)))
    if count == 0:
        yield passed("wheels", "jumps", "the angles do not jump")
        return
    largest = float(size[jumping].max())
    yield Finding(
        Severity.FAIL,
        "wheels",
        "jumps",
        f"the angle jumps {counted(count, 'time')}, by up to {largest:.4g} rad: "
        f"{_kind(track, jumping)}",
        float(count),
    )


def _kind(track: WheelTrack, jumping: BoolArray) -> str:
    """Return what the jumps look like."""
    spikes = sum(_spikes(*each) for each in zip(track.angle.T, jumping.T, strict=True))
    if spikes > 0.5 * jumping.sum():
        return (
            "readings leave and come back within a few samples (spikes): they are damaged on the "
            "way; mend the wiring or the driver"
        )
    steps = np.diff(track.angle, axis=0)[jumping]
    if steps.size > 1 and np.ptp(np.abs(steps)) < 0.02 * np.abs(steps).max() + 0.5:
        turns = float(np.median(np.abs(steps))) / (2.0 * math.pi)
        if abs(turns - 1.0) < 0.1:
            return "the angle wraps every turn; give it unwrapped"
        if np.mean(np.abs(np.diff(np.sign(steps)))) < 1.0:
            return f"a counter wraps every {turns:.4g} turns; give the angle unwrapped"
    after = np.abs(track.angle[1:][jumping])
    if np.median(after) < JUMP:
        return "a counter starts again at 0; keep counting in the driver"
    return "readings are damaged, a counter wraps or starts again; mend the driver"


def _spikes(angle: FloatArray, jumping: BoolArray) -> int:
    """Return how many jumps of one encoder belong to readings that leave and come back."""
    jumps = np.flatnonzero(jumping)
    count = begin = 0
    while begin < jumps.size:
        first = jumps[begin]
        until = int(np.searchsorted(jumps, first + SPIKE, side="right"))
        away = np.abs(angle[jumps[begin + 1 : until] + 1] - angle[first])
        back = np.flatnonzero(away < JUMP)
        taken = int(back[0]) + 2 if back.size else 1
        count += taken if back.size else 0
        begin += taken
    return count
