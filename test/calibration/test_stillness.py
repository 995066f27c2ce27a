"""Biases of a robot at rest, and refusal of one that moves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.calibration.stillness import StillnessSettings, still_calibration
from twbr_estimation.errors import ConfigurationError, MotionError
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.robot import Calibration, Robot, Setup
from twbr_estimation.samples import Sample

BIAS = (0.03, -0.02, 0.01)


def at_rest(seconds: float = 3.0, dt: float = 0.002, tilt: float = 0.0) -> np.ndarray:
    """Return rows of noisy samples of a robot at rest with gyro biases."""
    generator = np.random.default_rng(3)
    count = round(seconds / dt)
    rows = np.zeros((count, 10))
    rows[:, 0] = dt
    rows[:, 1:4] = BIAS + generator.normal(0.0, 0.002, (count, 3))
    rows[:, 4:7] = generator.normal(0.0, 0.04, (count, 3))
    rows[:, 4] -= 9.80665 * math.sin(tilt)
    rows[:, 6] += 9.80665 * math.cos(tilt)
    rows[:, 9] = 2.0
    return rows


def calibrated(rows: np.ndarray, **settings: object) -> Calibration:
    samples = [Sample(*row) for row in rows.tolist()]
    return still_calibration(
        samples,
        Calibration(),
        Robot(),
        StillnessSettings(**settings),  # type: ignore[arg-type]
    )


def test_biases_within_three_standard_errors() -> None:
    found = calibrated(at_rest())
    np.testing.assert_allclose(found.gyro_bias, BIAS, atol=3.0 * 0.002 / math.sqrt(1000))
    assert found.accel_bias == (0.0, 0.0, 0.0)


def test_accelerometer_biases_through_mounting_and_scale_polynomial() -> None:
    robot = Robot(mounting=(0.02, 0.05, -0.01))
    known = Calibration(accel_scale_x=(0.02, 1e-3), accel_scale_z=(-0.01, 5e-4))
    settings = StillnessSettings(accelerometer=True, tilt=0.1)
    rows = at_rest(tilt=0.3)  # the bias explains the rest
    rows[:, 4:7] -= rows[:, 4:7] - rows[:, 4:7].mean(axis=0)
    found = still_calibration([Sample(*row) for row in rows.tolist()], known, robot, settings)
    corrected = Corrector(Setup(robot, found)).step(Sample(*rows[-1].tolist()))
    expected = 9.80665 * np.array([-math.sin(0.1), 0.0, math.cos(0.1)])
    np.testing.assert_allclose(
        [corrected.accel_x, corrected.accel_y, corrected.accel_z], expected, atol=1e-6
    )


@pytest.mark.parametrize(
    ("column", "change", "said"),
    [
        (2, 0.3, r"0\.[56] s ago: rate 0\.\d+ rad/s .* limit 0.02"),
        (4, 2.0, r"0\.[56] s ago: acceleration .* m/s\^2 .* limit 0.2"),
        (7, 0.1, r"0\.[56] s ago: wheel angle 0\.\d+ rad .* limit 0.02"),
    ],
)
def test_motion_is_refused_with_time_and_size(column: int, change: float, said: str) -> None:
    rows = at_rest()
    rows[-300:-250, column] += change
    with pytest.raises(MotionError, match=said):
        calibrated(rows)


def test_motion_before_the_time_that_counts_does_not_matter() -> None:
    rows = at_rest(seconds=3.0)
    rows[:400, 2] += 1.0
    np.testing.assert_allclose(calibrated(rows).gyro_bias, BIAS, atol=5e-4)


def test_steady_turning_is_not_taken_for_a_bias() -> None:
    rows = at_rest()
    rows[:, 3] += 0.6
    with pytest.raises(MotionError, match="mean rate"):
        calibrated(rows)


@pytest.mark.parametrize("gap", [None, 200])
def test_too_few_readings_are_refused(gap: int | None) -> None:
    rows = at_rest(seconds=1.0 if gap is None else 2.2)
    if gap is not None:
        rows[gap, 0] = 0.5
    with pytest.raises(ConfigurationError, match="2 s are needed"):
        calibrated(rows)


def test_nothing_at_all_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"only 0.00 s"):
        still_calibration([], Calibration(), Robot(), StillnessSettings())
