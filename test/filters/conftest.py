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


@pytest.fixture
def swinging() -> Callable[..., list[CorrectedSample]]:
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
        return [sample(*map(float, row)) for row in zip(steps, angle, rate, strict=True)]

    return motion


@pytest.fixture
def still() -> Callable[..., list[CorrectedSample]]:
    """A robot that stands at an angle, seen by perfect sensors."""

    def motion(n: int, dt: float, angle: float) -> list[CorrectedSample]:
        return [sample(0.0, angle, 0.0), *[sample(dt, angle, 0.0)] * (n - 1)]

    return motion
