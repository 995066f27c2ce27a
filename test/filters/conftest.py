"""Motions for the filter tests, as lists of corrected samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from twbr_estimation.samples import CorrectedSample

AMPLITUDE, FREQUENCY = 0.2, 6.0
ANGLE_NOISE, RATE_NOISE = 0.02, 0.002


def sample(dt: float, angle: float, rate: float) -> CorrectedSample:
    return CorrectedSample(
        dt=dt,
        angle=angle,
        angle_variance=ANGLE_NOISE**2,
        gyro_x=0.0,
        gyro_y=rate,
        gyro_z=0.0,
        accel_x=-9.81 * float(np.sin(angle)),
        accel_y=0.0,
        accel_z=9.81 * float(np.cos(angle)),
        gyro_variance_x=RATE_NOISE**2,
        gyro_variance_y=RATE_NOISE**2,
        gyro_variance_z=RATE_NOISE**2,
        accel_variance_x=0.04,
        accel_variance_y=0.04,
        accel_variance_z=0.04,
        wheel_angle=0.0,
        wheel_difference=0.0,
        wheel_count=0.0,
    )


SATURATED = range(3, 6)
"""Of ten samples, those whose gyro is beyond its range; the first of them has a shock, too."""


@pytest.fixture
def equipment() -> str:
    """What the samples hold; tests of filters that read wheels or motors go through all."""
    return "imu"


def equipped(samples: list[CorrectedSample], equipment: str) -> list[CorrectedSample]:
    """Return the samples with one wheel; or with two, then motors, then saturated readings."""
    found, time = [], 0.0
    for index, each in enumerate(samples):
        time += each.dt
        turned = 2.0 * float(np.sin(3.0 * time)) - each.angle
        fields = {"wheel_angle": turned, "wheel_count": 1.0}
        if equipment != "one wheel":
            both = {"wheel_difference": float(np.sin(time)), "wheel_count": 2.0}
            fields |= {**both, "gyro_z": 0.2 * float(np.cos(time))}
        if equipment in ("motors", "saturation"):
            volts = 2.0 * float(np.cos(4.0 * time))
            fields |= {"voltage": volts, "voltage_difference": 0.3 * volts, "motor_count": 2.0}
        if equipment == "saturation" and index % 10 in SATURATED:
            fields |= {"gyro_saturated_y": 1.0, "gyro_variance_y": 4.8}
            if index % 10 == SATURATED[0]:
                fields |= {"accel_saturated_x": 1.0, "accel_variance_x": 96.0}
        found.append(each if equipment == "imu" else each._replace(**fields))
    return found


@pytest.fixture
def swinging(equipment: str) -> Callable[..., list[CorrectedSample]]:
    """A robot that swings, its sensors noisy, the sampling period 20 % uneven by default."""

    def motion(
        n: int, dt: float = 0.002, jitter: float = 0.2, noise: float = 1.0, seed: int = 1
    ) -> list[CorrectedSample]:
        random = np.random.default_rng(seed)
        steps = dt * (1.0 + jitter * random.uniform(-1.0, 1.0, n))
        steps[0] = 0.0
        time = np.cumsum(steps)
        angle = AMPLITUDE * np.sin(FREQUENCY * time) + noise * random.normal(0, ANGLE_NOISE, n)
        rate = AMPLITUDE * FREQUENCY * np.cos(FREQUENCY * time)
        rate += noise * random.normal(0, RATE_NOISE, n)
        rows = zip(steps, angle, rate, strict=True)
        return equipped([sample(*map(float, row)) for row in rows], equipment)

    return motion


@pytest.fixture
def still() -> Callable[..., list[CorrectedSample]]:
    """A robot that stands at an angle, seen by perfect sensors."""

    def motion(n: int, dt: float, angle: float) -> list[CorrectedSample]:
        return [sample(0.0, angle, 0.0), *[sample(dt, angle, 0.0)] * (n - 1)]

    return motion
