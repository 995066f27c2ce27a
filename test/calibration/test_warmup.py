"""Gyro bias against temperature: against hidden slopes, on recordings and live."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.calibration.warmup import calibrate_warmup
from twbr_estimation.drives import Drive
from twbr_estimation.errors import CalibrationError, MotionError
from twbr_estimation.recording import ImuTrack, Recording, TemperatureTrack
from twbr_estimation.robot import Setup
from twbr_estimation.streams.correction import CorrectionStream

SLOPE = np.radians([0.03, -0.02, 0.005])
BIAS = np.radians([1.0, -2.0, 0.5])
MIDDLE = 30.0
DT = 0.02


def warming(seed: int, seconds: float = 400.0, rise: float = 12.0) -> Recording:
    """Return a robot at rest whose chip warms up with a time constant of 100 s."""
    noise = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, DT)
    stamps = np.asarray(time * 1e9 + 1e9, dtype=np.int64)
    temperature = 24.0 + rise * (1.0 - np.exp(-time / 100.0))
    wander = np.cumsum(noise.standard_normal((time.size, 3)), axis=0) * 1e-6
    gyro = BIAS + (temperature - MIDDLE)[:, None] * SLOPE + wander
    gyro += 0.0018 * noise.standard_normal(gyro.shape)
    accel = np.array([0.0, 0.0, 9.80665]) + 0.04 * noise.standard_normal(gyro.shape)
    shown = np.round(temperature[::50] + 0.05 * noise.standard_normal(time[::50].size), 1)
    return Recording(
        "warm-up", ImuTrack(stamps, gyro, accel), temperature=TemperatureTrack(stamps[::50], shown)
    )


def test_slopes_are_found_within_their_errors() -> None:
    away = []
    for seed in range(6):
        found = calibrate_warmup(warming(seed), Setup())
        calibration = found.setup.calibration
        errors = {each.name: each.error for each in found.quantities}
        for axis, name in enumerate("xyz"):
            error = errors[f"gyro bias slope {name}"]
            assert error is not None
            away.append((calibration.gyro_bias_slope[axis] - SLOPE[axis]) / error)
        at_middle = np.array(calibration.gyro_bias)
        at_middle += SLOPE * (MIDDLE - calibration.gyro_bias_temperature)
        assert at_middle == pytest.approx(BIAS, abs=np.radians(0.02))
    assert np.abs(away).max() < 3.0
    assert found.provenance["temperature_low"] == pytest.approx(24.0, abs=0.5)


def test_what_cannot_be_determined_is_refused() -> None:
    cold = replace(warming(1), temperature=None)
    with pytest.raises(CalibrationError, match="no temperature"):
        calibrate_warmup(cold, Setup())
    with pytest.raises(CalibrationError, match=r"changes by .* K, 3 K are needed"):
        calibrate_warmup(warming(1, rise=1.0), Setup())
    with pytest.raises(CalibrationError, match="too short"):
        calibrate_warmup(warming(1, seconds=30.0), Setup())


def test_a_robot_that_moved_is_refused() -> None:
    recording = warming(2)
    recording.imu.gyro[10_000:10_100, 1] += 0.2
    with pytest.raises(MotionError, match=r"moved 20\d\.\d s after the start"):
        calibrate_warmup(recording, Setup())


def test_the_slope_is_taken_off_a_recording_and_a_stream_alike() -> None:
    setup = calibrate_warmup(warming(3), Setup()).setup
    recording = warming(4)
    drive = Drive(recording, setup)
    offline = drive.corrected.field("gyro_y")
    assert np.abs(offline[::50].reshape(-1, 40).mean(axis=1)).max() < np.radians(0.06)
    plain = Drive(
        recording,
        replace(setup, calibration=replace(setup.calibration, gyro_bias_slope=(0.0, 0.0, 0.0))),
    )
    assert np.abs(plain.corrected.field("gyro_y")[:500].mean()) > np.radians(0.08)
    stream = CorrectionStream(setup, wait=0.0)
    assert recording.temperature is not None
    late = recording.temperature.temperature[-1]
    stream.add_temperature(float(late))
    stream.add_temperature(float("nan"))
    assert stream.counts["bad_temperatures"] == 1
    imu, rates = recording.imu, []
    for index in range(imu.stamps.size - 2000, imu.stamps.size):
        ready = stream.add_imu(int(imu.stamps[index]), (*imu.gyro[index], *imu.accel[index]))
        rates += [sample.gyro_y for _, sample in ready]
    assert np.mean(rates) == pytest.approx(0.0, abs=np.radians(0.02))
