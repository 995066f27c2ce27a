"""The wheels at the instant of an IMU sample.

Both streams are paired by their stamps: the encoder angle is interpolated between the
wheel readings around the IMU sample. A live stream may wait for the later of the two, but
never longer than a bounded time; then the last readings are extrapolated, and once they
are too old the sample goes on without a wheel. `pair` does for whole tracks what `Pairer`
does sample by sample, with the same numbers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .samples import Sample

if TYPE_CHECKING:  # a live stream needs no recordings, and a node starts sooner without
    from .recording import FloatArray, ImuTrack, StampArray, WheelTrack

DEFAULT_WAIT = 0.005
"""How long a sample waits for a later wheel reading [s]."""
WHEEL_TIMEOUT = 0.25
"""Wheel readings further apart, or older, than this say nothing about now [s]."""
_SECOND = 1_000_000_000
_MOST_WHEEL_READINGS = 4096


@dataclass(frozen=True, slots=True)
class SampleTrack:
    """Paired samples as columns."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    columns: FloatArray
    """The fields of `Sample` as rows, (10, n)."""


class WheelReading(NamedTuple):
    """One reading of the wheel encoders."""

    stamp: int
    """Header stamp [ns]."""
    angle: float
    """Mean angle of the wheels [rad]."""
    difference: float
    """Right minus left [rad]; 0 with one encoder."""
    encoders: float
    """Number of encoders, 1 or 2."""


_NO_WHEEL = (0.0, 0.0, 0.0)


def wheel_reading(stamp: int, angles: Sequence[float]) -> WheelReading:
    """Return the reading of one wheel [rad], or of left and right, stamped `stamp` [ns]."""
    if len(angles) == 1:
        return WheelReading(stamp, angles[0], 0.0, 1.0)
    left, right = angles
    return WheelReading(stamp, 0.5 * (left + right), right - left, 2.0)


class Pairer:
    """Pairs two live streams by their stamps.

    Feed every reading in the order of its own stream; samples come out in order, none is
    lost. Time is what the stamps say: no clock is read.
    """

    def __init__(self, wait: float = DEFAULT_WAIT) -> None:
        """`wait`: how much later [s] than a sample its wheel reading may be stamped."""
        self._wait = round(wait * _SECOND)
        self._timeout = round(WHEEL_TIMEOUT * _SECOND)
        self._wheels: deque[WheelReading] = deque(maxlen=_MOST_WHEEL_READINGS)
        self._pending: deque[tuple[int, tuple[float, ...]]] = deque()
        self._first_stamp: int | None = None
        self._last_stamp: int | None = None

    def reset(self) -> None:
        """Forget everything, pending samples included."""
        self._wheels.clear()
        self._pending.clear()
        self._first_stamp = self._last_stamp = None

    def forget_wheels(self) -> None:
        """Forget the wheel readings, because their clock was set back."""
        self._wheels.clear()

    def restart(self, stamp: int) -> None:
        """Begin again at `stamp` [ns], because the IMU's clock was set back.

        Wheel readings of the new time, which may have come first, stay.
        """
        self._pending.clear()
        self._first_stamp = self._last_stamp = None
        if self._wheels and self._wheels[-1].stamp > stamp + self._timeout:
            self._wheels.clear()

    def add_wheels(self, reading: WheelReading) -> list[tuple[int, Sample]]:
        """Take a wheel reading; return the samples it completes, with their stamps.

        A reading that is not newer than the one before is ignored.
        """
        if not self._wheels or reading.stamp > self._wheels[-1].stamp:
            self._wheels.append(reading)
        return self._release()

    def add_imu(self, stamp: int, values: tuple[float, ...]) -> list[tuple[int, Sample]]:
        """Take an IMU reading (gyro x, y, z, accel x, y, z); return what is complete now."""
        if self._first_stamp is None:
            self._first_stamp = stamp
        self._pending.append((stamp, values))
        return self._release()

    def flush(self) -> list[tuple[int, Sample]]:
        """Return what still waits, without waiting longer."""
        return [self._complete() for _ in range(len(self._pending))]

    def _release(self) -> list[tuple[int, Sample]]:
        released = []
        while self._pending and self._ready(self._pending[0][0], self._pending[-1][0]):
            released.append(self._complete())
        return released

    def _ready(self, stamp: int, now: int) -> bool:
        last_seen = self._wheels[-1].stamp if self._wheels else self._first_stamp
        assert last_seen is not None  # there is a pending sample, so there was a first one
        if self._wheels and last_seen >= stamp:
            return True
        return now - stamp >= self._wait or stamp - last_seen > self._timeout

    def _complete(self) -> tuple[int, Sample]:
        stamp, values = self._pending.popleft()
        dt = 0.0 if self._last_stamp is None else (stamp - self._last_stamp) * 1e-9
        self._last_stamp = stamp
        return stamp, Sample(*(dt, *values, *self._wheels_at(stamp)))

    def _wheels_at(self, stamp: int) -> tuple[float, float, float]:
        wheels = self._wheels
        while len(wheels) > 2 and wheels[2].stamp <= stamp:
            wheels.popleft()
        if not wheels or wheels[0].stamp > stamp:
            return _NO_WHEEL
        last = 1 if len(wheels) > 1 and wheels[1].stamp <= stamp else 0
        if wheels[last].stamp == stamp:
            return wheels[last].angle, wheels[last].difference, wheels[last].encoders
        if len(wheels) > last + 1 and wheels[last + 1].stamp <= stamp + self._wait:
            return self._between(stamp, wheels[last], wheels[last + 1])
        if last == 1 and stamp - wheels[1].stamp <= self._timeout:
            return self._between(stamp, wheels[0], wheels[1])
        return _NO_WHEEL

    def _between(
        self, stamp: int, earlier: WheelReading, later: WheelReading
    ) -> tuple[float, float, float]:
        if later.stamp - earlier.stamp > self._timeout:
            return _NO_WHEEL
        share = (stamp - earlier.stamp) / (later.stamp - earlier.stamp)
        return (
            earlier.angle + share * (later.angle - earlier.angle),
            earlier.difference + share * (later.difference - earlier.difference),
            later.encoders,
        )


def pair(imu: ImuTrack, wheels: WheelTrack | None, wait: float = DEFAULT_WAIT) -> SampleTrack:
    """Pair whole tracks, as a `Pairer` would.

    Args:
        imu: n readings.
        wheels: the encoder readings, or None for a robot without.
        wait: how much later [s] than a sample its wheel reading may be stamped.

    Returns:
        n samples; those without a usable wheel reading have `wheel_count` 0.
    """
    columns = np.zeros((len(Sample._fields), imu.stamps.size))
    columns[0, 1:] = np.diff(imu.stamps) * 1e-9
    columns[1:4] = imu.gyro.T
    columns[4:7] = imu.accel.T
    if wheels is not None and wheels.stamps.size > 0 and imu.stamps.size > 0:
        columns[7:10] = _wheels_at(imu.stamps, wheels, round(wait * _SECOND))
    return SampleTrack(imu.stamps, columns)


def _wheels_at(stamps: StampArray, wheels: WheelTrack, wait: int) -> FloatArray:
    timeout = round(WHEEL_TIMEOUT * _SECOND)
    times, count = wheels.stamps, wheels.stamps.size
    last = np.searchsorted(times, stamps, side="right") - 1
    following = np.minimum(last + 1, count - 1)
    exact = (last >= 0) & (times[last] == stamps)
    inside = (last >= 0) & (following > last) & (times[following] <= stamps + wait)
    extrapolated = (last >= 1) & (stamps - times[last] <= timeout)
    earlier = np.maximum(np.where(inside | exact, last, last - 1), 0)
    later = np.where(inside, following, np.maximum(last, 0))
    gap = times[later] - times[earlier]
    known = exact | ((inside | extrapolated) & (gap <= timeout))
    share = np.where(exact | (gap == 0), 0.0, (stamps - times[earlier]) / np.maximum(gap, 1))
    both = np.stack([_mean(wheels.angle), _difference(wheels.angle)])
    result = both[:, earlier] + share * (both[:, later] - both[:, earlier])
    encoders = np.full(stamps.size, float(wheels.angle.shape[1]))
    return np.asarray(np.where(known, np.vstack([result, encoders]), 0.0), dtype=np.float64)


def _mean(angle: FloatArray) -> FloatArray:
    return angle[:, 0] if angle.shape[1] == 1 else 0.5 * (angle[:, 0] + angle[:, 1])


def _difference(angle: FloatArray) -> FloatArray:
    return np.zeros(angle.shape[0]) if angle.shape[1] == 1 else angle[:, 1] - angle[:, 0]
