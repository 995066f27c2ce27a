"""The simulated swing is one motion: IMU, wheels and tilt agree through the correction."""

from __future__ import annotations

import math

import pytest

from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.robot import CorrectionSettings, Setup
from twbr_estimation.samples import Sample
from twbr_estimation.sensors.motion import swing, swing_tilt, swing_wheel


def test_the_corrected_angle_is_the_tilt_of_the_swing() -> None:
    dt = 0.002
    exact = CorrectionSettings(rate_time_constant=0.0, velocity_time_constant=0.0)
    corrector = Corrector(Setup(correction=exact))
    errors = []
    for tick in range(2000):
        time = tick * dt
        felt = swing(time)
        sample = Sample(dt if tick else 0.0, *felt[:6], swing_wheel(time), 0.0, 1.0)
        errors.append(corrector.step(sample).angle - swing_tilt(time))
    # What is left is the half-sample delay of a difference quotient.
    assert max(map(abs, errors[10:])) < math.radians(0.01)


def test_the_rate_is_the_derivative_of_the_tilt() -> None:
    for time in (0.1, 0.7, 1.9):
        slope = (swing_tilt(time + 1e-4) - swing_tilt(time - 1e-4)) / 2e-4
        assert swing(time).gyro_y == pytest.approx(slope, rel=1e-5)
