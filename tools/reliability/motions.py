"""Motions for the live path: a swing, a turn by hand, and the readings of an IMU in them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reliability.live_path import Arrival
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import Calibration, Robot, Setup
from twbr_estimation.samples import STANDARD_GRAVITY

PERIOD = 0.005
"""[s]."""
FINE = 10
"""Steps of a motion in a period; readings are means over them."""
FIRST_STAMP = 1_700_000_000_000_000_000
GYRO_NOISE, ACCEL_NOISE = math.radians(0.05), 0.04
RANGE = math.radians(250.0)


@dataclass(frozen=True, slots=True)
class Motion:
    """A tilt over time, on a fine grid from zero on."""

    tilt: FloatArray
    """[rad], (n,)."""
    rest: float = 0.0
    """Instant from which on the robot rests [s]."""


def setup_of(arm: float = 0.05) -> Setup:
    """Return a robot whose sensor is `arm` [m] above the axle and clips at 250 deg/s and 2 g."""
    robot = Robot(lever_arm=(0.0, 0.0, arm), gyro_range=RANGE, accel_range=2.0 * STANDARD_GRAVITY)
    return Setup(robot, Calibration(gyro_noise=GYRO_NOISE, accel_noise=ACCEL_NOISE))


def grid(seconds: float) -> FloatArray:
    """Return instants [s]."""
    return np.arange(round(seconds / PERIOD) * FINE, dtype=np.float64) * (PERIOD / FINE)


def swing(seconds: float, degrees: float, frequency: float) -> Motion:
    """Return a swing about the axle."""
    time = grid(seconds)
    return Motion(np.asarray(math.radians(degrees) * np.sin(math.tau * frequency * time)))


def turn(degrees: float, duration: float, back: bool, random: np.random.Generator) -> Motion:
    """Return a robot that stands, is turned by hand, and back after a pause where asked for."""
    time, start = grid(8.0), 3.0
    pause = float(random.uniform(0.2, 0.5))
    share, rest = _smooth(time, start, duration), start + duration
    if back:
        share = share - _smooth(time, rest + pause, duration)
        rest += pause + duration
    lean = math.radians(random.uniform(-3.0, 3.0))
    side = float(random.choice([-1.0, 1.0]))
    return Motion(np.asarray(lean + side * math.radians(degrees) * share), rest)


def _smooth(time: FloatArray, start: float, duration: float) -> FloatArray:
    part = np.clip((time - start) / duration, 0.0, 1.0)
    return np.asarray(part**3 * (10.0 - 15.0 * part + 6.0 * part**2))


def arrivals(motion: Motion, setup: Setup, random: np.random.Generator) -> Iterator[Arrival]:
    """Yield what an IMU at the robot's lever arm reads, clipped, and the standing wheels."""
    step, arm, robot = PERIOD / FINE, setup.robot.lever_arm[2], setup.robot
    rate = np.gradient(motion.tilt, step)
    ahead = np.gradient(rate, step) * arm - STANDARD_GRAVITY * np.sin(motion.tilt)
    up = STANDARD_GRAVITY * np.cos(motion.tilt) - arm * rate * rate
    count = motion.tilt.size // FINE
    bias = math.radians(random.uniform(-0.3, 0.3))
    gyro = _read(rate, GYRO_NOISE, robot.gyro_range, random) + bias
    x = _read(ahead, ACCEL_NOISE, robot.accel_range, random)
    z = _read(up, ACCEL_NOISE, robot.accel_range, random)
    gyro = np.clip(gyro, -robot.gyro_range, robot.gyro_range)
    tilt = motion.tilt[FINE - 1 :: FINE]
    for index in range(count):
        stamp = FIRST_STAMP + round(index * PERIOD * 1e9)
        readings = (0.0, float(gyro[index]), 0.0, float(x[index]), 0.0, float(z[index]))
        yield Arrival(index * PERIOD, stamp, readings, float(tilt[index]), -float(tilt[index]))


def _read(true: FloatArray, noise: float, limit: float, random: np.random.Generator) -> FloatArray:
    means = true.reshape(-1, FINE).mean(1)
    return np.asarray(np.clip(means + random.normal(0.0, noise, means.size), -limit, limit))
