"""A hard day: a recording, the setup that the estimator gets, and when the body lies still."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...recording import FloatArray, Recording, TiltTrack, WheelTrack
from ...robot import Calibration, Robot, Setup
from .prescribed import Motion, Sensor, counted, readings

DEGREE = math.pi / 180.0
NOISE = Calibration(gyro_noise=0.0018, accel_noise=0.04)


@dataclass(frozen=True, slots=True)
class Day:
    """One recording with its truth."""

    recording: Recording
    setup: Setup
    """As the estimator gets it."""
    rests: tuple[tuple[float, float], ...] = ()
    """When the body lies still after it was thrown, from and to [s]."""
    recovers: tuple[float, ...] = ()
    """When an event ends after which the body moves on [s]."""


Maker = Callable[[int, float], Day]
"""Makes a day from a seed and a sampling period [s]."""


def robot_of(random: np.random.Generator, **changes: object) -> Robot:
    """Return a robot of some size, with two wheels and a gyro that rarely clips."""
    radius = random.uniform(0.025, 0.08)
    values = {
        "wheel_radius": radius,
        "lever_arm": (0.0, 0.0, random.uniform(0.04, 0.25)),
        "track_width": random.uniform(0.12, 0.3),
        "gyro_range": 500.0 * DEGREE,
        "accel_range": 4.0 * 9.80665,
    }
    return Robot(**{**values, **changes})  # type: ignore[arg-type]


def ramp(time: FloatArray, begin: float, end: float) -> FloatArray:
    """Return a smooth step from 0 to 1."""
    share = np.clip((time - begin) / (end - begin), 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share * share)


def between(time: FloatArray, begin: float, end: float, edge: float) -> FloatArray:
    """Return 1 from `begin` to `end` and 0 elsewhere, with smooth edges inside."""
    return ramp(time, begin, begin + edge) - ramp(time, end - edge, end)


def clock(period: float, duration: float, fine: float = 5e-4) -> tuple[float, FloatArray]:
    """Return the step that divides `period` and is near `fine`, and the instants [s]."""
    step = period / max(round(period / fine), 1)
    return step, np.arange(0.0, duration, step)


def balancing(time: FloatArray, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return tilt [rad] and forward position [m] of a robot that balances, from rest."""
    begin, (a, b, c) = ramp(time, 0.5, 1.5), random.uniform(0.0, 2.0 * math.pi, 3)
    tilt = random.uniform(2.0, 5.0) * np.sin(math.tau * random.uniform(0.5, 0.9) * time + a)
    tilt += random.uniform(1.0, 2.5) * np.sin(math.tau * random.uniform(1.5, 2.3) * time + b)
    ahead = random.uniform(0.06, 0.15) * np.sin(math.tau * random.uniform(0.25, 0.45) * time + c)
    return begin * tilt * DEGREE, begin * ahead


def recorded(
    name: str,
    motion: Motion,
    wheels: FloatArray | None,
    robot: Robot,
    period: float,
    seed: int,
    sensor: Sensor | None = None,
    *,
    true_robot: Robot | None = None,
    counts: int = 1320,
    rests: tuple[tuple[float, float], ...] = (),
    recovers: tuple[float, ...] = (),
) -> Day:
    """Return the day of a motion.

    Args:
        name: of the day.
        motion: what the body does.
        wheels: angles of the wheels against the body [rad], (n,) or (n, w), or None.
        robot: as the estimator gets it.
        period: sampling period [s].
        seed: of the noise.
        sensor: its errors.
        true_robot: where it differs from `robot`.
        counts: of the encoder in one turn.
        rests: see `Day`.
        recovers: see `Day`.
    """
    imu, tilt, chosen = readings(motion, true_robot or robot, sensor or Sensor(), period, seed)
    track = None
    if wheels is not None:
        angles = wheels.reshape(motion.tilt.size, -1)[chosen]
        track = WheelTrack(imu.stamps, counted(angles, counts) if counts else angles)
    truth = TiltTrack(imu.stamps, tilt)
    source = f"hard day: {name}, dt {period:g} s, seed {seed}"
    recording = Recording(source, imu, track, reference=truth, truth=truth)
    return Day(recording, Setup(robot, NOISE), rests, recovers)
