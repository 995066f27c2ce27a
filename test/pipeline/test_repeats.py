"""Repeated readings of the wheels are left out; a coarse encoder and one that stands are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation import Estimator, WheelTrack
from twbr_estimation.batch import correct, run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.pairing import Pairer, new_readings, pair, wheel_reading
from twbr_estimation.recording import FloatArray
from twbr_estimation.simulation import Simulated, simulate

MILLISECOND = 1_000_000
PERIOD = 5 * MILLISECOND


def track(angle: FloatArray) -> WheelTrack:
    """Return readings of the angles [rad], (n, 1 or 2), every 5 ms."""
    return WheelTrack(PERIOD * np.arange(1, len(angle) + 1), angle)


def held(angle: FloatArray, times: int) -> FloatArray:
    """Return readings that are new every so many."""
    found: FloatArray = angle[np.arange(len(angle)) // times * times]
    return found


def swaying(seconds: float = 20.0) -> FloatArray:
    """Return the angles of two wheels of a robot that balances and turns, (n, 2)."""
    time = 0.005 * np.arange(round(seconds / 0.005))
    mean, turn = np.sin(3.0 * time) + 0.3 * np.sin(11.0 * time), 0.4 * np.sin(time)
    return np.stack([mean - turn, mean + turn], axis=1)


def standing(angle: FloatArray) -> FloatArray:
    """Return the angles where the wheels stand still from 8 to 12 s."""
    time = 0.005 * np.arange(len(angle))
    return angle[np.searchsorted(time, np.where((time > 8.0) & (time < 12.0), 8.0, time))]


@pytest.mark.parametrize("times", [2, 3, 4, 6, 10])
@pytest.mark.parametrize("encoders", [1, 2])
def test_repeats_are_left_out_once_they_are_seen(times: int, encoders: int) -> None:
    wheels = track(held(swaying(), times)[:, :encoders])
    new = new_readings(wheels)
    late = new.stamps > 2_000 * MILLISECOND
    assert np.all((new.stamps[late] // PERIOD - 1) % times == 0)
    assert late.sum() > 0.9 * 18.0 / (0.005 * times)


@pytest.mark.parametrize("times", [1, 2, 4, 7])
@pytest.mark.parametrize("wait", [0, 5, 12])
def test_live_and_batch_leave_out_the_same(times: int, wait: int) -> None:
    simulated = simulate("W2", 0.005, 20.0, 61)
    imu, wheels = simulated.recording.imu, simulated.recording.wheels
    assert wheels is not None
    wheels = replace(wheels, angle=held(standing(wheels.angle), times))
    pairer, out = Pairer(1e-3 * wait), []
    following = 0
    for stamp, gyro, accel in zip(imu.stamps.tolist(), imu.gyro, imu.accel, strict=True):
        while following < wheels.stamps.size and wheels.stamps[following] <= stamp:
            at, angles = int(wheels.stamps[following]), wheels.angle[following].tolist()
            out += pairer.add_wheels(wheel_reading(at, angles))
            following += 1
        out += pairer.add_imu(stamp, (*gyro.tolist(), *accel.tolist()))
    out += pairer.flush()
    batch = pair(imu, wheels, 1e-3 * wait).columns
    assert np.array_equal(np.array([sample for _, sample in out]).T, batch)
    assert (pairer.repeated > 0.0) == (times > 1)


def test_a_wheel_that_stands_is_seen_to_stand() -> None:
    wheels = track(held(standing(swaying()), 4))
    new = new_readings(wheels)
    stands = (new.stamps > 8_050 * MILLISECOND) & (new.stamps < 12_000 * MILLISECOND)
    assert np.diff(new.stamps[stands]).max() <= 30 * MILLISECOND


@pytest.mark.parametrize("counts", [12, 48, 200, 1320, 4096])
@pytest.mark.parametrize("speed", [0.05, 0.4, 3.0, 20.0])
def test_a_coarse_encoder_repeats_nothing(counts: int, speed: float) -> None:
    step = 2.0 * np.pi / counts
    wheels = track(step * np.round(speed * standing(swaying()) / step))
    assert new_readings(wheels) is wheels


def test_rounding_is_no_step() -> None:
    step = 2.0 * np.pi / 1320
    angle = step * np.round(swaying() / step)
    wheels = track(angle + 2e-16 * np.random.default_rng(3).integers(0, 2, angle.shape))
    assert new_readings(wheels) is wheels


def test_a_finer_encoder_that_starts_from_rest_repeats_nothing() -> None:
    wheels = track(standing(swaying()))
    assert new_readings(wheels) is wheels


def error(simulated: Simulated, wheels: WheelTrack | None) -> tuple[float, float]:
    """Return the MSE [deg^2] of the default filter and for how long it ignored its wheels [s]."""
    entry, truth = filter_named("ins_odometer"), simulated.recording.truth
    assert truth is not None and entry.wheels_ignored is not None
    corrected = correct(pair(simulated.recording.imu, wheels), simulated.setup)
    found = run_filter(entry, entry.configure(), corrected, simulated.setup.robot)
    off = np.degrees(found.tilt - np.interp(found.stamps, truth.stamps, truth.tilt))
    return float(np.mean(off**2)), entry.wheels_ignored(found.state)


@pytest.mark.parametrize("seed", [62, 63])
@pytest.mark.parametrize(("times", "factor"), [(2, 1.2), (3, 2.5)])
def test_repeated_readings_cost_the_default_filter_little(
    times: int, factor: float, seed: int
) -> None:
    simulated = simulate("W1", 0.005, 40.0, seed)
    wheels = simulated.recording.wheels
    assert wheels is not None
    found, ignored = error(simulated, replace(wheels, angle=held(wheels.angle, times)))
    assert found < factor * error(simulated, wheels)[0] + 0.01
    assert ignored == 0.0


def test_readings_repeated_for_20_ms_are_better_than_none() -> None:
    simulated = simulate("W1", 0.005, 40.0, 64)
    wheels = simulated.recording.wheels
    assert wheels is not None
    found, ignored = error(simulated, replace(wheels, angle=held(wheels.angle, 4)))
    assert found < 0.3 * error(simulated, None)[0]
    assert ignored == 0.0


def test_the_estimator_leaves_them_out_too() -> None:
    simulated = simulate("W1", 0.005, 40.0, 65)
    recording, truth = simulated.recording, simulated.recording.truth
    assert recording.wheels is not None and truth is not None
    true, angle = np.interp(recording.imu.stamps, truth.stamps, truth.tilt), recording.wheels.angle
    assert np.array_equal(recording.imu.stamps, recording.wheels.stamps)

    def mse(angle: FloatArray) -> float:
        estimator, off = Estimator(robot=simulated.setup), []
        steps = zip(recording.imu.gyro, recording.imu.accel, angle, true, strict=True)
        for gyro, accel, wheels, tilt in steps:
            estimate = estimator.step(0.005, gyro.tolist(), accel.tolist(), wheels.tolist())
            off.append(np.degrees(estimate.tilt - tilt))
        return float(np.mean(np.square(off)))

    assert mse(held(angle, 3)) < 2.0 * mse(angle) + 0.02
