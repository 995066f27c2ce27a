"""Sensor readings of a rigid body whose motion is prescribed, not simulated.

No dynamics and no equation of the filters is behind them: attitude and position are given as
functions of time and differentiated. What a robot suffers in a hand, in a fall or on a stand is
written down this way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...recording import FloatArray, ImuTrack, StampArray
from ...robot import Robot
from ...samples import STANDARD_GRAVITY

FIRST_STAMP = 1_000_000_000
"""Stamp of the first sample [ns]."""
WHEEL_COUNTS = 1320
"""Counts of the wheel encoder in one turn of the wheel."""


class Motion(NamedTuple):
    """A motion on a fine, even grid of n instants."""

    step: float
    """Time between two instants [s]."""
    tilt: FloatArray
    """Turn about the left axis after roll and yaw [rad], (n,)."""
    roll: FloatArray
    """Turn about the forward axis after yaw [rad], (n,)."""
    yaw: FloatArray
    """Turn about the vertical [rad], (n,)."""
    position: FloatArray
    """Middle of the axle, level axes [m], (n, 3)."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """What an inertial sensor makes of a motion."""

    gyro_noise: float = 0.0018
    """Standard deviation [rad/s]."""
    accel_noise: float = 0.04
    """Standard deviation [m/s^2]."""
    gyro_gain: float = 1.0
    accel_gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    accel_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m/s^2]."""
    averaged: float = 0.0
    """Length of the moving mean that stands for the low-pass [s]."""
    clips_first: bool = False
    """Whether the sensor clips before its low-pass."""


def planar(
    step: float, tilt: FloatArray, ahead: FloatArray, up: FloatArray | None = None
) -> Motion:
    """Return a motion in the vertical plane.

    Args:
        step: time between two instants [s].
        tilt: [rad], (n,).
        ahead: forward position of the axle [m], (n,).
        up: height of the axle [m], (n,); 0 where not given.
    """
    zero = np.zeros_like(tilt)
    position = np.stack([ahead, zero, zero if up is None else up], axis=1)
    return Motion(step, tilt, zero, zero, position)


def rolled_angle(motion: Motion, ahead: FloatArray, robot: Robot) -> FloatArray:
    """Return the angle of one wheel against the body that rolled `ahead` [m], (n,)."""
    return ahead / robot.wheel_radius - motion.tilt


def counted(angle: FloatArray, counts: int = WHEEL_COUNTS) -> FloatArray:
    """Return wheel angles [rad] as an encoder of so many counts a turn shows them."""
    quantum = 2.0 * math.pi / counts
    return np.asarray(np.floor(angle / quantum) * quantum)


def readings(
    motion: Motion, robot: Robot, sensor: Sensor, period: float, seed: int
) -> tuple[ImuTrack, FloatArray, StampArray]:
    """Return what an IMU reads at every `period` [s].

    Args:
        motion: on a grid that divides the period.
        robot: true position of the sensor, and its ranges.
        sensor: its errors.
        period: sampling period [s].
        seed: of the noise.

    Returns:
        The readings, the true tilt at their stamps [rad] (m,), and the index of each stamp on
        the motion's grid (m,).
    """
    rate, force = rate_and_force(motion, robot)
    gyro_limit, accel_limit = robot.gyro_range, robot.accel_range
    if sensor.clips_first:
        rate = np.clip(rate, -gyro_limit, gyro_limit)
        force = np.clip(force, -accel_limit, accel_limit)
    every = round(period / motion.step)
    chosen = np.arange(every, motion.tilt.size - every, every)
    rate, force = _sampled(rate, chosen, sensor, motion), _sampled(force, chosen, sensor, motion)
    random = np.random.default_rng(seed)
    noise = random.standard_normal((2, chosen.size, 3))
    gyro = sensor.gyro_gain * rate + sensor.gyro_noise * noise[0]
    accel = force * sensor.accel_gain + sensor.accel_bias + sensor.accel_noise * noise[1]
    stamps = FIRST_STAMP + np.rint(np.arange(chosen.size) * period * 1e9).astype(np.int64)
    imu = ImuTrack(
        stamps,
        np.clip(gyro, -gyro_limit, gyro_limit),
        np.clip(accel, -accel_limit, accel_limit),
    )
    return imu, motion.tilt[chosen], chosen


def rate_and_force(motion: Motion, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return body rates [rad/s] and specific forces [m/s^2] of the sensor, (n, 3) each."""
    turn, step = attitudes(motion), motion.step
    place = motion.position + turn @ np.array(robot.lever_arm)
    acceleration = np.gradient(np.gradient(place, step, axis=0), step, axis=0)
    acceleration[:, 2] += STANDARD_GRAVITY
    force = np.einsum("nji,nj->ni", turn, acceleration)
    between = np.einsum("nji,njk->nik", turn[:-2], turn[2:])
    rate = np.zeros_like(force)
    for axis, (row, column) in enumerate(((2, 1), (0, 2), (1, 0))):
        rate[1:-1, axis] = (between[:, row, column] - between[:, column, row]) / (4.0 * step)
    rate[0], rate[-1] = rate[1], rate[-2]
    return rate, force


def attitudes(motion: Motion) -> FloatArray:
    """Return the matrices that turn body axes into level axes, (n, 3, 3)."""
    (sp, sr, sy), (cp, cr, cy) = (
        [function(angle) for angle in (motion.tilt, motion.roll, motion.yaw)]
        for function in (np.sin, np.cos)
    )
    rows = (
        (cy * cp - sy * sr * sp, -sy * cr, cy * sp + sy * sr * cp),
        (sy * cp + cy * sr * sp, cy * cr, sy * sp - cy * sr * cp),
        (-cr * sp, sr, cr * cp),
    )
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def _sampled(values: FloatArray, chosen: StampArray, sensor: Sensor, motion: Motion) -> FloatArray:
    """Return the values at the chosen instants, averaged over what came just before."""
    length = max(round(sensor.averaged / motion.step), 1)
    sums = np.cumsum(np.vstack([np.repeat(values[:1], length, axis=0), values]), axis=0)
    return np.asarray((sums[chosen + length] - sums[chosen]) / length)
