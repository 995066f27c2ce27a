"""Pairing of IMU and wheels: live and batch agree, late and dead encoders degrade."""

from __future__ import annotations

from operator import attrgetter

import numpy as np
import pytest

from twbr_estimation.pipeline.pairing import (
    MOTOR_TIMEOUT,
    Pairer,
    WheelReading,
    motor_command,
    pair,
)
from twbr_estimation.recording import ImuTrack, MotorTrack, WheelTrack
from twbr_estimation.samples import MOTORS, WHEELS, Sample

MILLISECOND = 1_000_000
MOTORS_OF = attrgetter(*MOTORS)


def imu_track(stamps: np.ndarray) -> ImuTrack:
    """Return an IMU at rest with distinguishable readings at the given stamps [ns]."""
    gyro = np.arange(3.0 * stamps.size).reshape(-1, 3)
    return ImuTrack(stamps, gyro, gyro + 0.5)


def live(imu: ImuTrack, wheels: WheelTrack, wait: float) -> np.ndarray:
    """Feed a `Pairer` with both tracks in the order of their stamps, wheels first."""
    pairer = Pairer(wait)
    events = [(int(stamp), 0, index) for index, stamp in enumerate(wheels.stamps)]
    events += [(int(stamp), 1, index) for index, stamp in enumerate(imu.stamps)]
    out: list[tuple[int, Sample]] = []
    for stamp, kind, index in sorted(events):
        if kind == 0:
            angle = wheels.angle[index]
            difference = float(angle[1] - angle[0]) if angle.size == 2 else 0.0
            reading = WheelReading(stamp, float(angle.mean()), difference, float(angle.size))
            out += pairer.add_wheels(reading)
        else:
            values = (*imu.gyro[index].tolist(), *imu.accel[index].tolist())
            out += pairer.add_imu(stamp, values)
    out += pairer.flush()
    assert [stamp for stamp, _ in out] == imu.stamps.tolist()
    return np.array([sample for _, sample in out]).T


@pytest.mark.parametrize("wait_ms", [0, 3, 20])
@pytest.mark.parametrize("wheel_period_ms", [2, 7, 90])
@pytest.mark.parametrize("encoders", [1, 2])
def test_live_and_batch_pair_alike(wait_ms: int, wheel_period_ms: int, encoders: int) -> None:
    random = np.random.default_rng(wait_ms + wheel_period_ms)
    imu = imu_track(np.cumsum(random.integers(1, 4, 800)) * MILLISECOND)
    steps = random.integers(1, 2 * wheel_period_ms, 1600 // wheel_period_ms)
    stamps = np.cumsum(steps) * MILLISECOND + 300 * MILLISECOND
    stamps = stamps[(stamps < 900 * MILLISECOND) | (stamps > 1300 * MILLISECOND)]
    wheels = WheelTrack(stamps, np.cumsum(random.normal(size=(stamps.size, encoders)), axis=0))
    batch = pair(imu, wheels, wait_ms * 1e-3).columns
    np.testing.assert_allclose(live(imu, wheels, wait_ms * 1e-3), batch, rtol=0, atol=1e-12)
    assert set(batch[Sample._fields.index("wheel_count")]) == {0.0, float(encoders)}


def test_equal_stamps_give_the_reading_itself() -> None:
    stamps = np.arange(1, 50) * 2 * MILLISECOND
    wheels = WheelTrack(stamps, np.sin(np.arange(49.0))[:, None])
    paired = pair(imu_track(stamps), wheels)
    np.testing.assert_array_equal(paired.field("wheel_angle"), wheels.angle[:, 0])
    assert np.all(paired.field("wheel_count") == 1.0)


def test_interpolates_between_readings_within_the_wait() -> None:
    stamps = np.array([10, 12, 14, 16]) * MILLISECOND
    wheels = WheelTrack(np.array([10, 14, 18]) * MILLISECOND, np.array([[0.0], [4.0], [8.0]]))
    paired = pair(imu_track(stamps), wheels, wait=0.005)
    np.testing.assert_allclose(paired.field("wheel_angle"), [0.0, 2.0, 4.0, 6.0])


def test_dead_encoder_costs_no_latency_and_comes_back() -> None:
    pairer = Pairer(wait=0.005)
    pairer.add_wheels(WheelReading(0, 0.0, 0.0, 1.0))
    pairer.add_wheels(WheelReading(10 * MILLISECOND, 1.0, 0.0, 1.0))
    values = (0.0,) * 6
    for stamp in range(400, 500, 2):
        released = pairer.add_imu(stamp * MILLISECOND, values)
        assert [at for at, _ in released] == [stamp * MILLISECOND]
        assert released[0][1].wheel_count == 0.0
    pairer.add_wheels(WheelReading(499 * MILLISECOND, 3.0, 0.0, 1.0))
    pairer.add_wheels(WheelReading(500 * MILLISECOND, 3.5, 0.0, 1.0))
    (_, sample), *_ = pairer.add_imu(500 * MILLISECOND, values)
    assert (sample.wheel_angle, sample.wheel_count) == (3.5, 1.0)


def test_robot_without_encoder() -> None:
    paired = pair(imu_track(np.arange(1, 9) * MILLISECOND), None)
    assert not paired.fields(*WHEELS, *MOTORS).any()


@pytest.mark.parametrize("motors", [1, 2])
def test_the_latest_command_before_a_sample_is_held(motors: int) -> None:
    random = np.random.default_rng(motors)
    imu = imu_track(np.cumsum(random.integers(1, 4, 2000)) * MILLISECOND)
    stamps = np.cumsum(random.integers(1, 12, 400)) * MILLISECOND + 300 * MILLISECOND
    stamps = stamps[(stamps < 900 * MILLISECOND) | (stamps > 2400 * MILLISECOND)]
    track = MotorTrack(stamps, random.normal(size=(stamps.size, motors)))
    batch = pair(imu, None, motors=track).fields(*MOTORS).T
    pairer, live = Pairer(), []
    events = [(int(stamp), 1, index) for index, stamp in enumerate(imu.stamps)]
    events += [(int(stamp), 0, index) for index, stamp in enumerate(stamps)]
    for stamp, kind, index in sorted(events):
        if kind == 0:
            pairer.add_motors(motor_command(stamp, track.voltage[index].tolist()))
        else:
            live += pairer.add_imu(stamp, (0.0,) * 6)
    live += pairer.flush()
    np.testing.assert_array_equal(
        batch.T,
        [(sample.voltage, sample.voltage_difference, sample.motor_count) for _, sample in live],
    )
    for index, stamp in enumerate(imu.stamps):
        before = stamps[stamps < stamp]
        known = before.size > 0 and stamp - before[-1] <= MOTOR_TIMEOUT * 1e9
        assert batch[2, index] == (motors if known else 0.0)
        if known:
            held = track.voltage[before.size - 1]
            assert batch[0, index] == held.mean()
            assert batch[1, index] == (held[-1] - held[0])
    assert set(batch[2]) == {0.0, float(motors)}


def test_commands_of_an_old_time_go_when_the_clock_is_set_back() -> None:
    pairer = Pairer()
    pairer.add_motors(motor_command(10_000 * MILLISECOND, [5.0]))
    pairer.restart(100 * MILLISECOND)
    ((_, sample),) = pairer.add_imu(100 * MILLISECOND, (0.0,) * 6) + pairer.flush()
    assert sample.motor_count == 0.0
    pairer.add_motors(motor_command(101 * MILLISECOND, [2.0, 4.0]))
    ((_, sample),) = pairer.add_imu(102 * MILLISECOND, (0.0,) * 6) + pairer.flush()
    assert MOTORS_OF(sample) == (3.0, 2.0, 2.0)
