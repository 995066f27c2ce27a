"""Samples combined for a slower loop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.batch import correct, oversampled, run_filter
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.oversampling import Oversampler, combined
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import ImuTrack
from twbr_estimation.robot import Setup
from twbr_estimation.samples import READINGS, CorrectedSample
from twbr_estimation.simulation import Simulated, simulate
from twbr_estimation.streams.correction import CorrectionStream

GYRO_VARIANCE, ACCEL_VARIANCE, ANGLE_VARIANCE = 4e-6, 1e-3, 2e-5


def sample(
    dt: float = 0.001, angle: float = 0.0, rate: float = 0.0, **other: float
) -> CorrectedSample:
    zero = dict.fromkeys(CorrectedSample._fields, 0.0)
    variances = {f"gyro_variance_{axis}": GYRO_VARIANCE for axis in "xyz"}
    variances |= {f"accel_variance_{axis}": ACCEL_VARIANCE for axis in "xyz"}
    given = {"dt": dt, "angle": angle, "gyro_y": rate, "angle_variance": ANGLE_VARIANCE}
    return CorrectedSample(**{**zero, **variances, **given, **other})


def feed(period: float, samples: list[CorrectedSample]) -> list[CorrectedSample]:
    oversampler = Oversampler(period)
    return [found for each in samples if (found := oversampler.add(each)) is not None]


@pytest.mark.parametrize("period", [0.0, 0.0005, 0.001])
def test_a_loop_as_fast_as_the_sensor_takes_every_sample_as_it_is(period: float) -> None:
    samples = [sample(0.0), *(sample(angle=0.01 * k, rate=k) for k in range(5))]
    assert feed(period, samples) == samples


def test_a_steady_acceleration_ends_where_it_is() -> None:
    """Uneven samples of a rate that grows linearly, and of the angle that goes with it."""
    steps = np.random.default_rng(1).uniform(0.0005, 0.0015, 12)
    time = np.cumsum(steps)
    rate, angle = 0.5 + 3.0 * time, 0.1 + 0.5 * time + 1.5 * time**2
    samples = [
        sample(dt, a, r, accel_x=-r, wheel_angle=a, wheel_count=2.0)
        for dt, a, r in zip(steps.tolist(), angle.tolist(), rate.tolist(), strict=True)
    ]
    result = combined(samples)
    assert result.dt == pytest.approx(time[-1])
    assert result.gyro_y == pytest.approx(rate[-1])
    assert result.accel_x == pytest.approx(-rate[-1])
    assert result.angle == pytest.approx(angle[-1], abs=1e-12)
    assert (result.wheel_angle, result.wheel_count) == (angle[-1], 2.0)


def test_the_variances_are_those_of_what_comes_out() -> None:
    random = np.random.default_rng(2)
    results = []
    for _ in range(4000):
        noise = random.standard_normal((10, 2)) * np.sqrt([ANGLE_VARIANCE, GYRO_VARIANCE])
        results.append(combined([sample(angle=a, rate=r) for a, r in noise.tolist()]))
    spread = np.var([(result.angle, result.gyro_y) for result in results], axis=0)
    assert spread[0] == pytest.approx(results[0].angle_variance, rel=0.1)
    assert spread[1] == pytest.approx(results[0].gyro_variance_y, rel=0.1)
    assert results[0].gyro_variance_y < 0.4 * GYRO_VARIANCE
    assert results[0].angle_variance == pytest.approx(0.1 * ANGLE_VARIANCE)


def test_a_saturated_sample_does_not_average_out() -> None:
    samples = [sample() for _ in range(10)]
    samples[4] = sample(
        gyro_variance_y=4.8,
        gyro_saturated_y=1.0,
        accel_variance_z=96.0,
        accel_saturated_z=1.0,
        angle=3.0,
        angle_variance=9.0,
    )
    result = combined(samples)
    assert (result.gyro_saturated_y, result.accel_saturated_z) == (1.0, 1.0)
    assert (result.gyro_saturated_x, result.accel_saturated_x) == (0.0, 0.0)
    assert result.gyro_variance_y == pytest.approx(4.8, rel=0.01)
    assert result.accel_variance_z == pytest.approx(96.0, rel=0.01)
    assert result.gyro_variance_x < GYRO_VARIANCE
    assert abs(result.angle) < 1e-4


def test_an_interval_of_saturated_samples_stays_saturated() -> None:
    result = combined([sample(gyro_variance_y=4.8, gyro_saturated_y=1.0)] * 20)
    assert result.gyro_saturated_y == 1.0
    assert result.gyro_variance_y == 4.8


@pytest.mark.parametrize("place", [0, 4, 9])
def test_an_interval_with_a_silence_is_silent(place: int) -> None:
    """A line through zeros would show a rate that there was not."""
    nothing = dict.fromkeys(READINGS, 0.0)
    samples = [sample(rate=1.0) for _ in range(10)]
    samples[place] = samples[place]._replace(**nothing, gyro_saturated_y=1.0)
    result = combined(samples)
    assert [getattr(result, name) for name in READINGS] == [0.0] * 6
    assert result.gyro_saturated_y == 1.0
    assert result.dt == pytest.approx(sum(each.dt for each in samples))


def test_the_angle_is_averaged_across_the_half_turn() -> None:
    angles = [math.pi - 0.02, -math.pi + 0.02, math.pi - 0.01, -math.pi + 0.01]
    assert abs(combined([sample(angle=angle) for angle in angles]).angle) == pytest.approx(math.pi)


def test_the_voltage_is_the_mean_over_the_interval() -> None:
    samples = [
        sample(0.001, voltage=1.0, voltage_difference=0.5, motor_count=2.0),
        sample(0.003, voltage=3.0, voltage_difference=-0.5, motor_count=2.0),
    ]
    assert motors_of(combined(samples)) == pytest.approx((2.5, -0.25, 2.0))
    samples.append(sample(0.001))
    assert motors_of(combined(samples)) == (0.0, 0.0, 0.0)


def motors_of(each: CorrectedSample) -> tuple[float, float, float]:
    return each.voltage, each.voltage_difference, each.motor_count


@pytest.mark.parametrize(("dt", "count"), [(0.001, 10), (0.003, 3), (0.004, 2), (0.007, 1)])
def test_an_interval_is_the_nearest_number_of_samples(dt: float, count: int) -> None:
    found = feed(0.01, [sample(dt) for _ in range(60)])
    assert {round(each.dt / dt) for each in found} == {count}
    assert len(found) == 60 // count


def test_a_gap_starts_a_new_interval_at_once() -> None:
    samples = [sample() for _ in range(14)] + [sample(1.5, 0.2)] + [sample() for _ in range(10)]
    found = feed(0.01, samples)
    assert [round(each.dt, 6) for each in found] == [0.01, 1.5, 0.01]
    assert found[1] == samples[14]


def test_the_live_stream_equals_the_batch() -> None:
    recording = simulate("W4", 0.001, 3.0, 1).recording
    assert recording.wheels is not None
    stream, live = CorrectionStream(Setup(), wait=0.0, loop_period=0.01), []
    for stamp, gyro, accel in zip(
        recording.imu.stamps.tolist(),
        recording.imu.gyro.tolist(),
        recording.imu.accel.tolist(),
        strict=True,
    ):
        live += stream.add_imu(stamp, (*gyro, *accel))
    track = oversampled(correct(pair(recording.imu, None), Setup()), 0.01)
    assert [stamp for stamp, _ in live] == track.stamps.tolist()
    np.testing.assert_allclose(track.columns.T, [each for _, each in live], rtol=1e-9, atol=1e-12)
    assert track.stamps.size == 300


@pytest.mark.parametrize(
    ("name", "every"), [("complementary", 20), ("kalman", 20), ("ins_odometer", 10)]
)
def test_what_it_gives_on_the_rig(name: str, every: int) -> None:
    plain, combined_ = [], []
    for seed in (201, 202, 203):
        simulated = simulate("W1", 0.001, 30.0, seed)
        imu, wheels = simulated.recording.imu, simulated.recording.wheels
        slow = ImuTrack(imu.stamps[::every], imu.gyro[::every], imu.accel[::every])
        plain.append(_mse(name, correct(pair(slow, wheels), simulated.setup), simulated))
        fast = correct(pair(imu, wheels), simulated.setup)
        combined_.append(_mse(name, oversampled(fast, 0.001 * every), simulated))
    assert np.mean(combined_) < 0.95 * np.mean(plain)


def _mse(name: str, corrected, simulated: Simulated) -> float:
    entry, truth = filter_named(name), simulated.recording.truth
    assert truth is not None
    track = run_filter(entry, entry.configure(), corrected, simulated.setup.robot)
    error = track.tilt - np.interp(track.stamps, truth.stamps, truth.tilt)
    return float(np.mean(np.degrees(error) ** 2))
