"""A small recording to write, and equality of recordings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from twbr_estimation.recording import (
    ImuTrack,
    MotorTrack,
    Recording,
    TemperatureTrack,
    TiltTrack,
    WheelTrack,
)

START = 1_700_000_000_000_000_000


def make_recording(samples: int = 50, wheels: int = 2, seed: int = 1, motors: int = 0) -> Recording:
    """Return noise on every track; reference and wheels cover the IMU's time."""
    random = np.random.default_rng(seed)
    stamps = START + 2_000_000 * np.arange(samples)
    return Recording(
        "test",
        ImuTrack(stamps, random.normal(size=(samples, 3)), random.normal(size=(samples, 3))),
        WheelTrack(stamps, random.normal(size=(samples, wheels))),
        TiltTrack(stamps, random.normal(size=samples), random.normal(size=samples)),
        TiltTrack(stamps, random.normal(size=samples)),
        {"dmp": TiltTrack(stamps, random.uniform(-3.0, 3.0, samples), random.normal(size=samples))},
        TemperatureTrack(stamps[::10], random.normal(size=stamps[::10].size)),
        MotorTrack(stamps[::2] + 1000, random.normal(size=(stamps[::2].size, motors)))
        if motors
        else None,
    )


def require_same_tilt(track: TiltTrack | None, expected: TiltTrack | None) -> None:
    """Require equal tracks; a tilt through a quaternion may round."""
    assert (track is None) == (expected is None)
    if track is None or expected is None:
        return
    np.testing.assert_array_equal(track.stamps, expected.stamps)
    np.testing.assert_allclose(track.tilt, expected.tilt, rtol=0.0, atol=1e-14)
    assert (track.rate is None) == (expected.rate is None)
    if track.rate is not None and expected.rate is not None:
        np.testing.assert_array_equal(track.rate, expected.rate)


def require_same(recording: Recording, expected: Recording) -> None:
    """Require the same data on every track."""
    np.testing.assert_array_equal(recording.imu.stamps, expected.imu.stamps)
    np.testing.assert_array_equal(recording.imu.gyro, expected.imu.gyro)
    np.testing.assert_array_equal(recording.imu.accel, expected.imu.accel)
    assert recording.imu.frame_id == expected.imu.frame_id
    assert (recording.wheels is None) == (expected.wheels is None)
    if recording.wheels is not None and expected.wheels is not None:
        np.testing.assert_array_equal(recording.wheels.stamps, expected.wheels.stamps)
        np.testing.assert_array_equal(recording.wheels.angle, expected.wheels.angle)
    assert (recording.motors is None) == (expected.motors is None)
    if recording.motors is not None and expected.motors is not None:
        np.testing.assert_array_equal(recording.motors.stamps, expected.motors.stamps)
        np.testing.assert_array_equal(recording.motors.voltage, expected.motors.voltage)
    require_same_tilt(recording.reference, expected.reference)
    require_same_tilt(recording.truth, expected.truth)
    assert recording.estimators.keys() == expected.estimators.keys()
    for name, track in recording.estimators.items():
        require_same_tilt(track, expected.estimators[name])


@pytest.fixture
def small_recording() -> Callable[..., Recording]:
    """Return what makes a recording of noise; see `make_recording`."""
    return make_recording


@pytest.fixture
def assert_same() -> Callable[[Recording, Recording], None]:
    """Return what requires two recordings to hold the same data."""
    return require_same
