"""The wheels and the motors at the instant of an IMU sample.

Both streams are paired by their stamps: the encoder angle is interpolated between the
wheel readings around the IMU sample. A live stream may wait for the later of the two, but
never longer than a bounded time; then the last readings are extrapolated, and once they
are too old the sample goes on without a wheel. Readings that are only repeated are left out
(`repeats`). The motors' voltage is that of the latest command given before the sample, which
nothing has to wait for. `pair` does for whole tracks what `Pairer` does sample by sample, with the
same numbers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..samples import MOTORS, NANOSECONDS_PER_SECOND, READINGS, WHEELS, Sample
from .repeats import Repeats, begin, counting, follow

if TYPE_CHECKING:  # a live stream needs no recordings, and a node starts sooner without
    from ..recording import FloatArray, ImuTrack, MotorTrack, StampArray, WheelTrack

DEFAULT_WAIT = 0.005
"""Longest wait of a sample for a later wheel reading [s]."""
WHEEL_TIMEOUT = 0.25
"""Wheel readings further apart, or older, than this are not used [s]."""
MOTOR_TIMEOUT = 1.0
"""A motor command older than this is not used [s]."""
_MOST_READINGS = 4096


class SampleTrack(NamedTuple):
    """Paired samples as columns."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    columns: FloatArray
    """The fields of `Sample` as rows, (13, n)."""

    @classmethod
    def of(cls, samples: Sequence[Sample]) -> SampleTrack:
        """Return samples as a track; the stamps count from the first."""
        columns = np.array(samples, dtype=np.float64).reshape(-1, len(Sample._fields)).T
        times = np.cumsum(columns[Sample._fields.index("dt")])
        return cls(np.round((times - times[:1]) * 1e9).astype(np.int64), columns)

    def since(self, index: int) -> SampleTrack:
        """Return the samples from an index on."""
        return SampleTrack(self.stamps[index:], self.columns[:, index:])

    def field(self, name: str) -> FloatArray:
        """Return one field of `Sample` over time, (n,)."""
        row: FloatArray = self.columns[Sample._fields.index(name)]
        return row

    def fields(self, *names: str) -> FloatArray:
        """Return fields of `Sample` over time, one column each, (n, names)."""
        return np.stack([self.field(name) for name in names], axis=1)


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


class MotorCommand(NamedTuple):
    """One command to the motors."""

    stamp: int
    """When it was given [ns]."""
    voltage: float
    """Mean voltage of the motors [V]."""
    difference: float
    """Right minus left [V]; 0 where both get the same."""
    motors: float
    """Number of voltages in the command, 1 or 2."""


_UNKNOWN = (0.0, 0.0, 0.0)


def wheel_reading(stamp: int, angles: Sequence[float]) -> WheelReading:
    """Return the reading of one wheel [rad], or of left and right, stamped `stamp` [ns]."""
    return WheelReading(stamp, *_mean_difference_count(angles))


def motor_command(stamp: int, voltages: Sequence[float]) -> MotorCommand:
    """Return the command of one voltage [V] for both motors, or of left and right."""
    return MotorCommand(stamp, *_mean_difference_count(voltages))


def _mean_difference_count(values: Sequence[float]) -> tuple[float, float, float]:
    if len(values) == 1:
        return values[0], 0.0, 1.0
    left, right = values
    return 0.5 * (left + right), right - left, 2.0


class Pairer:
    """Pairs live streams by their stamps.

    Feed every reading in the order of its own stream; samples come out in order, none is
    lost. Time is that of the stamps: no clock is read.
    """

    def __init__(self, wait: float = DEFAULT_WAIT) -> None:
        """`wait`: how much later [s] than a sample its wheel reading may be stamped."""
        self._wait = round(wait * NANOSECONDS_PER_SECOND)
        self._timeout = round(WHEEL_TIMEOUT * NANOSECONDS_PER_SECOND)
        self._motor_timeout = round(MOTOR_TIMEOUT * NANOSECONDS_PER_SECOND)
        self._wheels: deque[WheelReading] = deque(maxlen=_MOST_READINGS)
        self._repeats: Repeats | None = None
        self._motors: deque[MotorCommand] = deque(maxlen=_MOST_READINGS)
        self._pending: deque[tuple[int, tuple[float, ...]]] = deque()
        self._first_stamp: int | None = None
        self._last_stamp: int | None = None

    def reset(self) -> None:
        """Forget everything, pending samples included."""
        self.forget_wheels()
        self._motors.clear()
        self._pending.clear()
        self._first_stamp = self._last_stamp = None

    @property
    def repeated(self) -> float:
        """For how long the wheels' readings are repeated [s]; 0 where they are not."""
        return self._repeats.repeated if self._repeats is not None else 0.0

    def forget_wheels(self) -> None:
        """Forget the wheel readings, because their clock was set back."""
        self._wheels.clear()
        self._repeats = None

    def restart(self, stamp: int) -> None:
        """Begin again at `stamp` [ns], because the IMU's clock was set back.

        Wheel readings and motor commands of the new time, which may have come first, stay.
        """
        self._pending.clear()
        self._first_stamp = self._last_stamp = None
        if self._wheels and self._wheels[-1].stamp > stamp + self._timeout:
            self.forget_wheels()
        if self._motors and self._motors[-1].stamp > stamp + self._motor_timeout:
            self._motors.clear()

    def add_motors(self, command: MotorCommand) -> None:
        """Take a motor command; one from before the latest means that its clock was set back."""
        if self._motors and command.stamp < self._motors[-1].stamp:
            self._motors.clear()
        self._motors.append(command)

    def add_wheels(self, reading: WheelReading) -> list[tuple[int, Sample]]:
        """Take a wheel reading; return the samples it completes, with their stamps.

        A reading that is not newer than the one before is ignored.
        """
        stamp, angle, difference, _ = reading
        if self._repeats is None:
            self._repeats = begin(stamp, angle, difference)
            self._wheels.append(reading)
        elif stamp > self._repeats.latest:
            self._repeats = follow(self._repeats, stamp, angle, difference)
            if self._repeats.counted == stamp:
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
        return stamp, Sample(*(dt, *values, *self.wheels_at(stamp), *self._motors_at(stamp)))

    def _motors_at(self, stamp: int) -> tuple[float, float, float]:
        motors = self._motors
        while len(motors) > 1 and motors[1].stamp < stamp:
            motors.popleft()
        if not motors or not 0 < stamp - motors[0].stamp <= self._motor_timeout:
            return _UNKNOWN
        return motors[0].voltage, motors[0].difference, motors[0].motors

    def wheels_at(self, stamp: int) -> tuple[float, float, float]:
        """Return angle, difference and count of the wheels; zeros where they are unknown.

        Args:
            stamp: when [ns]; not earlier than asked for before.
        """
        wheels = self._wheels
        while len(wheels) > 2 and wheels[2].stamp <= stamp:
            wheels.popleft()
        if not wheels or wheels[0].stamp > stamp:
            return _UNKNOWN
        last = 1 if len(wheels) > 1 and wheels[1].stamp <= stamp else 0
        if wheels[last].stamp == stamp:
            return wheels[last].angle, wheels[last].difference, wheels[last].encoders
        if len(wheels) > last + 1 and wheels[last + 1].stamp <= stamp + self._wait:
            return self._between(stamp, wheels[last], wheels[last + 1])
        if last == 1 and stamp - wheels[1].stamp <= self._timeout:
            return self._between(stamp, wheels[0], wheels[1])
        return _UNKNOWN

    def _between(
        self, stamp: int, earlier: WheelReading, later: WheelReading
    ) -> tuple[float, float, float]:
        if later.stamp - earlier.stamp > self._timeout:
            return _UNKNOWN
        share = (stamp - earlier.stamp) / (later.stamp - earlier.stamp)
        return (
            earlier.angle + share * (later.angle - earlier.angle),
            earlier.difference + share * (later.difference - earlier.difference),
            later.encoders,
        )


def pair(
    imu: ImuTrack,
    wheels: WheelTrack | None,
    wait: float = DEFAULT_WAIT,
    motors: MotorTrack | None = None,
) -> SampleTrack:
    """Pair whole tracks, as a `Pairer` would.

    Args:
        imu: n readings.
        wheels: the encoder readings, or None for a robot without.
        wait: how much later [s] than a sample its wheel reading may be stamped.
        motors: the commands to the motors, or None where they are unknown.

    Returns:
        n samples; those without a usable wheel reading have `wheel_count` 0, those without
        a motor command `motor_count` 0.
    """
    n = imu.stamps.size
    dt = np.concatenate([np.zeros(min(n, 1)), np.diff(imu.stamps) * 1e-9])
    rows = dict(zip(READINGS, [*imu.gyro.T, *imu.accel.T], strict=True))
    if wheels is not None and wheels.stamps.size > 0 and n > 0:
        rows |= zip(
            WHEELS,
            _wheels_at(imu.stamps, wheels, round(wait * NANOSECONDS_PER_SECOND)),
            strict=True,
        )
    if motors is not None and motors.stamps.size > 0:
        rows |= zip(MOTORS, _motors_at(imu.stamps, motors), strict=True)
    absent = np.zeros(n)
    columns = np.stack([dt if name == "dt" else rows.get(name, absent) for name in Sample._fields])
    return SampleTrack(imu.stamps, columns)


def new_readings(wheels: WheelTrack) -> WheelTrack:
    """Return the wheels without readings that are only repeated."""
    counts = counting(wheels.stamps, _mean(wheels.angle), _difference(wheels.angle))
    if np.all(counts):
        return wheels
    return replace(wheels, stamps=wheels.stamps[counts], angle=wheels.angle[counts])


def _wheels_at(stamps: StampArray, wheels: WheelTrack, wait: int) -> FloatArray:
    timeout = round(WHEEL_TIMEOUT * NANOSECONDS_PER_SECOND)
    wheels = new_readings(wheels)
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


def _motors_at(stamps: StampArray, motors: MotorTrack) -> FloatArray:
    last = np.searchsorted(motors.stamps, stamps, side="left") - 1
    held = np.maximum(last, 0)
    known = (last >= 0) & (
        stamps - motors.stamps[held] <= round(MOTOR_TIMEOUT * NANOSECONDS_PER_SECOND)
    )
    both = np.stack([_mean(motors.voltage), _difference(motors.voltage)])
    count = np.full(stamps.size, float(motors.voltage.shape[1]))
    return np.asarray(np.where(known, np.vstack([both[:, held], count]), 0.0), dtype=np.float64)


def _mean(values: FloatArray) -> FloatArray:
    return values[:, 0] if values.shape[1] == 1 else 0.5 * (values[:, 0] + values[:, 1])


def _difference(values: FloatArray) -> FloatArray:
    return np.zeros(values.shape[0]) if values.shape[1] == 1 else values[:, 1] - values[:, 0]
