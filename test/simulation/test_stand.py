"""The verification stand of Chudzik 2021."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.simulation import Simulated, simulate
from twbr_estimation.simulation.stand import FREQUENCY, STOP_ANGLE, SWING_ANGLES

SCENES = ("static", "vibrating", "pendulum", "jerking")


def made(scene: str, seed: int = 401, dt: float = 0.01) -> Simulated:
    return simulate("stand", dt, 60.0, seed, scene)


def accelerometer_deg(simulated: Simulated) -> np.ndarray:
    accel = simulated.recording.imu.accel
    return np.degrees(np.arctan2(-accel[:, 0], accel[:, 2]))


@pytest.mark.parametrize("scene", SCENES)
def test_the_reference_is_a_hundred_hertz_and_7200_counts(scene: str) -> None:
    recording = made(scene, dt=0.002).recording
    assert recording.imu.stamps.size == 30_000
    assert set(np.diff(recording.reference.stamps)) == {10_000_000}
    counts = recording.reference.tilt * 7200 / (2.0 * math.pi)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    error = recording.reference.tilt - recording.truth.tilt[::5]
    assert np.max(np.abs(error)) <= math.pi / 7200 + 1e-12


@pytest.mark.parametrize("scene", SCENES)
def test_there_are_no_wheels(scene: str) -> None:
    assert made(scene).recording.wheels is None


@pytest.mark.parametrize("scene", SCENES)
def test_the_gyro_is_the_reference_s_rate_with_the_printed_bias(scene: str) -> None:
    simulated = made(scene, dt=0.002)
    gyro, rate = simulated.recording.imu.gyro[:, 1], simulated.recording.truth.rate
    free = np.abs(rate) < math.radians(200.0)  # neither saturated nor in an impact
    bias = np.degrees(np.median((gyro - 0.99 * rate)[free]))
    assert bias == pytest.approx(0.7, abs=0.1)
    steps = np.diff(simulated.recording.truth.tilt)
    np.testing.assert_allclose(np.cumsum(0.002 * rate[1:]), np.cumsum(steps), atol=0.02)


def test_a_running_drive_gives_the_printed_deviation() -> None:
    found = [np.std(accelerometer_deg(made("vibrating", seed))) for seed in (402, 403, 404)]
    assert np.mean(found) == pytest.approx(1.25, abs=0.03)
    assert np.std(accelerometer_deg(made("static"))) < 0.2


def test_the_load_swings_as_a_pendulum() -> None:
    truth = made("pendulum").recording.truth
    assert SWING_ANGLES[0] < np.max(np.abs(truth.tilt)) < SWING_ANGLES[1] + 0.02
    acceleration = np.gradient(truth.rate, 0.01)
    free = np.abs(acceleration + FREQUENCY**2 * np.sin(truth.tilt)) < 2.0
    assert np.mean(free) > 0.7  # the rest of the time the hand holds it


def test_stops_limit_the_jerks() -> None:
    simulated = made("jerking", dt=0.0005)
    truth = simulated.recording.truth
    assert np.max(np.abs(truth.tilt)) < STOP_ANGLE + math.radians(0.5)
    assert np.max(np.abs(np.diff(truth.rate))) > 1.0  # [rad/s] within half a millisecond
    assert not np.array_equal(truth.tilt, made("jerking", 405, 0.0005).recording.truth.tilt)
