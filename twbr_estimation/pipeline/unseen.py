"""What the samples do not show: rotation in gaps, beyond the gyro's range, of a frozen sensor.

`begin` and `follow` are pure functions on named tuples, so that a batch can compile them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..samples import RESTART_GAP, CorrectedSample

ACCELERATION = 60.0
"""Angular acceleration that a robot in a hand or in a fall may reach unseen [rad/s^2]."""
LATE = 2.5
"""A time step longer than this multiple of the usual one is a gap."""
PERIOD_SHARE = 0.01
"""Share by which one time step moves the usual one."""
FREEZE = 0.1
"""Time over which six equal readings pass [s] before the sensor counts as frozen."""
PULL = 0.3
"""Time in which a filter may follow a saturated accelerometer by a radian [s]."""
SLOPE_MEMORY = 0.05
"""Time over which the largest change of the rate is kept [s]."""
SLOPE_MARGIN = 2.0
"""How many times that change may be exceeded once the gyro is saturated."""


class Stream(NamedTuple):
    """What is remembered of the samples."""

    period: float
    """Usual time step [s]; 0 before the second sample."""
    lost: float
    """Samples that gaps had room for, since the start."""
    frozen: float
    """Time over which all readings were the same [s]."""
    saturated: float
    """Time for which the gyro has been saturated [s]."""
    slope: float
    """Largest change of the rate of late [rad/s^2]."""
    gyro: tuple[float, float, float]
    """Rates one sample ago [rad/s]."""
    accel: tuple[float, float, float]
    """Specific forces one sample ago [m/s^2]."""


def begin(sample: CorrectedSample) -> Stream:
    """Start with a first sample."""
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    return Stream(0.0, 0.0, 0.0, 0.0, 0.0, gyro, accel)


def follow(before: Stream, sample: CorrectedSample) -> Stream:
    """Take one sample."""
    dt, last = sample.dt, before.period
    gyro = (sample.gyro_x, sample.gyro_y, sample.gyro_z)
    accel = (sample.accel_x, sample.accel_y, sample.accel_z)
    same = gyro == before.gyro and accel == before.accel
    still = gyro[0] == 0.0 and gyro[1] == 0.0 and gyro[2] == 0.0
    period, lost = min(dt, RESTART_GAP), before.lost
    if last > 0.0:
        period = last + PERIOD_SHARE * (min(dt, 2.0 * last) - last)
        lost += math.floor(dt / last + 0.5) - 1.0 if is_gap(before, dt) else 0.0
    slope = before.slope
    if sample.gyro_saturated_y == 0.0:
        slope *= SLOPE_MEMORY / (SLOPE_MEMORY + dt)
        if before.saturated == 0.0:
            slope = max(slope, abs(gyro[1] - before.gyro[1]) / dt)
    return Stream(
        period,
        lost,
        before.frozen + dt if same and not still else 0.0,
        before.saturated + dt if sample.gyro_saturated_y > 0.0 else 0.0,
        slope,
        gyro,
        accel,
    )


def is_gap(before: Stream, dt: float) -> bool:
    """Return whether samples are missing before one that comes `dt` [s] after the last."""
    return before.period > 0.0 and dt > LATE * before.period


def unseen_rotation(
    before: Stream, now: Stream, sample: CorrectedSample, self_judged: bool
) -> float:
    """Return the largest rotation that a sample does not show [rad].

    Args:
        before: what was remembered before it.
        now: what is remembered with it.
        sample: the reading.
        self_judged: whether the filter itself bounds what a saturated gyro hides.
    """
    dt, unseen = sample.dt, 0.0
    if now.saturated > 0.0 and not self_judged:
        unseen = max(SLOPE_MARGIN * now.slope, ACCELERATION) * now.saturated * dt
    if is_gap(before, dt):
        bridged = 0.5 * abs(now.gyro[1] - before.gyro[1]) * dt
        unseen += max(bridged, ACCELERATION * dt * dt / 12.0)
    if now.frozen > FREEZE:
        unseen += ACCELERATION * now.frozen * dt
    return unseen


def misled(sample: CorrectedSample) -> float:
    """Return how far a saturated accelerometer may pull a filter in one sample [rad]."""
    saturated = sample.accel_saturated_x + sample.accel_saturated_z
    return sample.dt / PULL if saturated > 0.0 else 0.0
