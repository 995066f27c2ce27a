from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.robot import CorrectionSettings, Robot, Setup
from twbr_estimation.samples import STANDARD_GRAVITY, Sample
from twbr_estimation.sensors.error_model import ACCEL_RESOLUTION, GYRO_RESOLUTION, read
from twbr_estimation.simulation.planar_sensing import imu_errors
from twbr_estimation.simulation.worlds import IDEAL, PAPER, W2

NOTHING = (0.0, 0.0, 0.0)
SILENT = (0.0,) * 6
EXACT = imu_errors(PAPER, PAPER.calibration, 1)._replace(
    gyro_gain=(1.0, 1.0, 1.0), gyro_acceleration=0.0, digital=False
)
"""The paper's biases and polynomials alone."""


def corrected(reading: tuple[float, ...]) -> tuple[float, ...]:
    settings = CorrectionSettings(euler=False, centrifugal=False, wheel=False)
    sample = Corrector(Setup(Robot(), PAPER.calibration, settings)).step(Sample(0.0, *reading))
    return (
        sample.gyro_x, sample.gyro_y, sample.gyro_z,
        sample.accel_x, sample.accel_y, sample.accel_z,
    )  # fmt: skip


@pytest.mark.parametrize("angle_deg", range(-180, 181, 15))
def test_the_correction_gives_back_what_was_disturbed(angle_deg):
    angle = math.radians(angle_deg)
    force = (-STANDARD_GRAVITY * math.sin(angle), 0.3, STANDARD_GRAVITY * math.cos(angle))
    rate = (0.1, -2.0, 0.3)
    reading = read(rate, force, NOTHING, SILENT, EXACT)
    np.testing.assert_allclose(corrected(reading), (*rate, *force), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("force", [(18.0, 0.0, -15.0), (-18.0, 0.0, 17.0)])
def test_beyond_the_calibrated_range_the_inverse_still_holds(force):
    reading = read(NOTHING, force, NOTHING, SILENT, EXACT)
    np.testing.assert_allclose(corrected(reading)[3:], force, rtol=0.0, atol=1e-9)


def test_the_paper_s_sensor_at_rest_reads_its_biases():
    reading = read(NOTHING, (0.0, 0.0, STANDARD_GRAVITY), NOTHING, SILENT, EXACT)
    assert math.degrees(reading[1]) == pytest.approx(-1.91195)
    assert reading[3] == pytest.approx(0.0234)
    # Between the extremes that the paper prints for its robot at rest.
    assert 8.98 < reading[5] < 9.39


def test_readings_saturate_at_the_registers_limits():
    errors = EXACT._replace(digital=True)
    high = read((9.0, 9.0, 9.0), (99.0, 99.0, 99.0), NOTHING, SILENT, errors)
    low = read((-9.0, -9.0, -9.0), (-99.0, -99.0, -99.0), NOTHING, SILENT, errors)
    np.testing.assert_allclose(np.degrees(high[:3]), 32767 / 131)
    np.testing.assert_allclose(np.degrees(low[:3]), -32768 / 131)
    np.testing.assert_allclose(high[3:], 32767 / 16384 * STANDARD_GRAVITY)
    np.testing.assert_allclose(low[3:], -2.0 * STANDARD_GRAVITY)


def test_readings_are_whole_counts():
    errors = EXACT._replace(digital=True)
    reading = read((0.1, 0.2, 0.3), (1.0, 2.0, 3.0), NOTHING, SILENT, errors)
    counts = np.array(reading) / np.repeat([GYRO_RESOLUTION, ACCEL_RESOLUTION], 3)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    exact = read((0.1, 0.2, 0.3), (1.0, 2.0, 3.0), NOTHING, SILENT, EXACT)
    assert np.all(np.abs(np.subtract(reading, exact))[:3] <= 0.5 * GYRO_RESOLUTION + 1e-12)
    assert np.all(np.abs(np.subtract(reading, exact))[3:] <= 0.5 * ACCEL_RESOLUTION + 1e-12)


def test_a_gyro_that_reads_low_and_is_sensitive_to_acceleration():
    errors = imu_errors(PAPER, IDEAL.calibration, 1)._replace(digital=False)
    upright = (0.0, 0.0, STANDARD_GRAVITY)
    assert read((0.0, 2.0, 0.0), upright, NOTHING, SILENT, errors)[1] == pytest.approx(1.95)
    pushed = (STANDARD_GRAVITY, 0.0, STANDARD_GRAVITY)
    assert math.degrees(read(NOTHING, pushed, NOTHING, SILENT, errors)[1]) == pytest.approx(0.1)


def test_the_residual_has_the_size_its_world_names():
    accelerations = np.linspace(-7.0, 7.0, 141)
    squares = []
    for seed in range(60):
        errors = imu_errors(W2, W2.calibration, seed)._replace(digital=False)
        readings = (
            read(NOTHING, (a, 0.0, a), NOTHING, SILENT, errors) for a in accelerations.tolist()
        )
        residual = np.array([corrected(reading)[3] for reading in readings]) - accelerations
        assert residual[70] == pytest.approx(0.0, abs=1e-9)
        squares.append(np.mean(residual**2))
    assert math.sqrt(np.mean(squares)) == pytest.approx(0.1, rel=0.15)
