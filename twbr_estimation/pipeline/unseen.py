"""What the samples do not show: rotation in gaps, beyond the gyro's range, of a frozen sensor.

`begin` and `follow` are pure functions on named tuples, so that a batch can compile them.
"""

import math
from typing import NamedTuple

from ..samples import RESTART_GAP, STANDARD_GRAVITY, CorrectedSample

ACCELERATION = 60.0
"""Angular acceleration that a robot in a hand or in a fall may reach unseen [rad/s^2]."""
LATE = 2.5
"""A time step longer than this multiple of the usual one is a gap."""
PERIOD_SHARE = 0.01
"""Share by which one time step moves the usual one."""
FIRST_STEP = 0.05
"""A first time step longer than this [s] is a gap."""
SETTLING = 0.05
"""Time over which steps far below the usual one pass [s] before that is halved at each."""
GLITCH, RETURN = 10.0 * ACCELERATION, 0.25
"""Change of the rate [rad/s^2] that no robot undergoes, if the next sample takes it back but for
that share: a false reading."""
FREEZE = 0.1
"""Time over which six equal readings pass [s] before the sensor counts as frozen."""
PULL = 0.3
"""Time in which a filter may follow a saturated accelerometer by a radian [s]."""
SHOCK = 0.1
"""Time up to which a saturated accelerometer is a shock [s]; later its filter's rate suffers."""
SLOPE_MEMORY = 0.05
"""Time over which the largest change of the rate is kept [s]."""
SLOPE_MARGIN = 3.5
"""How many times that change may be exceeded once the gyro is saturated."""
GENTLE, LEVEL = SLOPE_MARGIN * ACCELERATION, 0.05
"""Change of the rate before and after a saturation [rad/s^2] below which it says little of what
passed, where that was long enough to hide so much [rad]."""
PASSED_FLOOR = 0.01
"""Smallest deviation of what is known of a rotation beyond the gyro's range [rad]."""


class Passed(NamedTuple):
    """A rotation beyond the gyro's range that is over; zeros where none has just ended."""

    time: float
    """How long the gyro was saturated [s]."""
    readings: float
    """How many there have been since, 1 or 2; the second one shows the rotation."""
    side: float
    """1 where the rate was positive, else -1."""
    exit: float
    """Steepest change of the rate since the end [rad/s^2]."""
    rotation: float
    """What was unseen of it, by the rate's slopes before and after [rad]."""


_NOTHING = Passed(0.0, 0.0, 0.0, 0.0, 0.0)


class Stream(NamedTuple):
    """What is remembered of the samples."""

    period: float
    """Usual time step [s]; 0 before the second sample."""
    short: float
    """Time for which the steps have been far below it [s]."""
    lost: float
    """Samples that gaps had room for, since the start."""
    frozen: float
    """Time over which all readings were the same [s]."""
    saturated: float
    """Time for which the gyro has been saturated [s]."""
    shocked: float
    """Time for which the accelerometer has been saturated [s]."""
    slope: float
    """Largest recent change of the rate [rad/s^2]."""
    jump: float
    """Its change from the sample before [rad/s]."""
    passed: Passed
    gyro: tuple[float, float, float]
    """Rates one sample ago [rad/s]."""
    accel: tuple[float, float, float]
    """Specific forces one sample ago [m/s^2]."""


def begin(sample: CorrectedSample) -> Stream:
    """Start with a first sample."""
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    return Stream(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, _NOTHING, gyro, accel)


def follow(before: Stream, sample: CorrectedSample, dt: float) -> Stream:
    """Take one sample, `dt` [s] after the last one that said anything."""
    last = before.period
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    same = gyro == before.gyro and accel == before.accel
    still = gyro[0] == 0.0 and gyro[1] == 0.0 and gyro[2] == 0.0 and _weighs(accel)
    short = before.short + dt if LATE * dt < last else 0.0
    lost = before.lost
    if last > 0.0 and is_gap(before, dt):
        lost += math.floor(dt / last + 0.5) - 1.0
    slope = before.slope
    if before.saturated == 0.0:
        slope = max(_faded(slope, dt), abs(gyro[1] - before.gyro[1]) / dt)
    elif sample.gyro_saturated_y == 0.0:
        slope = _faded(slope, dt)
    return Stream(
        _period(last, dt, short),
        short,
        lost,
        before.frozen + dt if same and not still else 0.0,
        before.saturated + dt if sample.gyro_saturated_y > 0.0 else 0.0,
        before.shocked + dt if sample.accel_saturated_x + sample.accel_saturated_z > 0.0 else 0.0,
        slope,
        gyro[1] - before.gyro[1],
        _passed(before, sample, dt),
        gyro,
        accel,
    )


def _weighs(accel: tuple[float, float, float]) -> bool:
    """Return whether a specific force is one of a robot that rests, and not zeros of the bus."""
    x, y, z = accel
    return x * x + y * y + z * z > (0.5 * STANDARD_GRAVITY) ** 2


def _period(last: float, dt: float, short: float) -> float:
    """Return the usual time step with one more; `short` [s] has passed in steps far below it.

    Samples that come in bursts have steps as short, but no longer than the usual one together.
    """
    if last == 0.0:
        return min(dt, RESTART_GAP)
    if short > min(last, SETTLING):
        return 0.5 * last
    return last + PERIOD_SHARE * (min(dt, 2.0 * last) - last)


def _faded(slope: float, dt: float) -> float:
    return slope * SLOPE_MEMORY / (SLOPE_MEMORY + dt)


def _passed(before: Stream, sample: CorrectedSample, dt: float) -> Passed:
    """Return what is known of a saturation of the gyro that has ended.

    The rate rose with the slope before it and fell with that after it: the area of the triangle
    above the range that these two span is what the gyro did not show. The slope after it takes
    two readings, of which the first holds an impact.
    """
    change = abs(sample.gyro_y - before.gyro[1]) / dt
    if before.saturated > 0.0 and sample.gyro_saturated_y == 0.0:
        return Passed(before.saturated, 1.0, math.copysign(1.0, before.gyro[1]), change, 0.0)
    last = before.passed
    if last.readings != 1.0:
        return _NOTHING
    fall = max(last.exit, change)
    height = before.slope * fall / max(before.slope + fall, 1e-9)
    return Passed(last.time, 2.0, last.side, fall, 0.5 * last.side * height * last.time * last.time)


def is_gap(before: Stream, dt: float) -> bool:
    """Return whether samples are missing before one that comes `dt` [s] after the last."""
    return dt > (LATE * before.period if before.period > 0.0 else FIRST_STEP)


def unseen_rotation(before: Stream, now: Stream, dt: float) -> float:
    """Return the largest rotation that a sample does not show [rad].

    Args:
        before: what was remembered before it.
        now: what is remembered with it.
        dt: time since the last one that said anything [s].
    """
    unseen = 0.0
    if now.saturated > 0.0:
        unseen = max(SLOPE_MARGIN * now.slope, ACCELERATION) * now.saturated * dt
    if is_gap(before, dt):
        bridged = 0.5 * abs(now.gyro[1] - before.gyro[1]) * dt
        unseen += max(bridged, ACCELERATION * dt * dt / 12.0)
    if now.frozen > FREEZE:
        unseen += ACCELERATION * now.frozen * dt
    return unseen + _false_turn(before.jump, now.jump, dt)


def _false_turn(there: float, back: float, dt: float) -> float:
    """Return what a false reading has turned [rad]: in the step to it, and in that after it.

    Args:
        there: change of the rate with the sample before this one [rad/s].
        back: change with this one.
        dt: time step [s].
    """
    size, larger = min(abs(there), abs(back)), max(abs(there), abs(back))
    if there * back >= 0.0 or size < GLITCH * dt or larger - size > RETURN * larger:
        return 0.0
    return 2.0 * size * dt


def uncertainty(passed: Passed) -> float:
    """Return the deviation of what is known of a rotation beyond the gyro's range [rad].

    A large one in a short time has slopes that no two readings show.
    """
    rotation = abs(passed.rotation)
    return PASSED_FLOOR + rotation * (1.0 + rotation)


def may_be_level(now: Stream) -> bool:
    """Return whether a rate beyond the range may have been level between the slopes seen.

    A fall ends by an impact, a push begins by one, and a fast turn has slopes that leave no time
    for more. Between gentle slopes a robot in a hand may have been turned on: the triangle shows
    the least of it.
    """
    gentle = max(now.slope, now.passed.exit) < GENTLE
    return gentle and 0.25 * ACCELERATION * now.passed.time * now.passed.time > LEVEL


def misled(now: Stream, sample: CorrectedSample, pull: float) -> float:
    """Return how far a saturated accelerometer may have pulled a filter in one sample [rad].

    Args:
        now: what is remembered with the sample.
        sample: the reading.
        pull: how far the filter is from what the gyro alone makes of its estimate before [rad];
            in a shock that is all.
    """
    if now.shocked == 0.0:
        return 0.0
    most = sample.dt / PULL
    return min(most, pull) if now.shocked < SHOCK else most
