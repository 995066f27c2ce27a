"""A filter judged by the samples: turned by hand, saturated, with gaps, frozen; and left alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from twbr_estimation.filters.base import filter_named
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.pipeline.watched_filter import WatchedFilter
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import CorrectionSettings, Robot, Setup
from twbr_estimation.samples import READINGS, STANDARD_GRAVITY, CorrectedSample, Sample

DT = 0.005
RANGE = math.radians(250.0)
PLANAR = ("complementary", "kalman", "kalman_adaptive", "kalman_extended", "alpha_beta_wb")
SOME = ("complementary", "kalman_adaptive", "alpha_beta_wb")
SELF_JUDGED = ("ins_odometer",)


@dataclass
class Outcome:
    """What a filter made of a motion."""

    time: FloatArray
    error: FloatArray
    """[deg]."""
    trusted: FloatArray
    running: WatchedFilter

    def wrong_and_trusted(self) -> float:
        return float(np.mean((self.error > 5.0) & (self.trusted > 0.0)))

    def after(self, instant: float) -> FloatArray:
        return np.asarray(self.time >= instant)


def smooth(time: FloatArray, start: float, duration: float) -> FloatArray:
    part = np.clip((time - start) / duration, 0.0, 1.0)
    return np.asarray(part**3 * (10.0 - 15.0 * part + 6.0 * part**2))


def samples(
    tilt: FloatArray, seed: int, bias: float = 0.0, accel_noise: float = 0.04
) -> Iterator[CorrectedSample]:
    random, rate = np.random.default_rng(seed), np.gradient(tilt, DT) + bias
    read = np.clip(rate + 0.002 * random.standard_normal(tilt.size), -RANGE, RANGE)
    noise = accel_noise * random.standard_normal((2, tilt.size))
    forward = -STANDARD_GRAVITY * np.sin(tilt) + noise[0]
    up = STANDARD_GRAVITY * np.cos(tilt) + noise[1]
    zeros = dict.fromkeys(CorrectedSample._fields, 0.0)
    for gyro, x, z in zip(read.tolist(), forward.tolist(), up.tolist(), strict=True):
        full = abs(gyro) >= 0.999 * RANGE
        yield CorrectedSample(
            **{
                **zeros,
                "dt": DT,
                "angle": math.atan2(-x, z),
                "angle_variance": 2e-5,
                "gyro_y": gyro,
                "accel_x": x,
                "accel_z": z,
                "gyro_variance_y": 5.0 if full else 4e-6,
                "gyro_saturated_y": float(full),
            }
        )


def run(name: str, tilt: FloatArray, readings: list[CorrectedSample]) -> Outcome:
    """Filter the readings; one whose `dt` is 0 is lost, the next one bridges it."""
    running = WatchedFilter(filter_named(name))
    time, error, trusted, gap = [], [], [], 0.0
    for index, (true, sample) in enumerate(zip(tilt.tolist(), readings, strict=True)):
        gap += DT
        if sample.dt == 0.0:
            continue
        estimate = running.step(sample._replace(dt=gap))
        gap = 0.0
        time.append(index * DT)
        error.append(math.degrees(abs(math.remainder(estimate.tilt - true, 2.0 * math.pi))))
        own = estimate.tilt_variance <= running.valid_stddev**2
        trusted.append(float(running.trusted and own))
    return Outcome(np.array(time), np.array(error), np.array(trusted), running)


def swing(seconds: float, degrees: float = 6.0) -> FloatArray:
    time = np.arange(0.0, seconds, DT)
    return np.asarray(math.radians(degrees) * np.sin(2.0 * math.pi * 0.9 * time))


def fast_turn(degrees: float, duration: float, back: bool) -> FloatArray:
    """Return the tilt [rad] of a turn that begins at 3 s, and of one back 0.3 s after it."""
    time = np.arange(0.0, 8.0, DT)
    tilt = smooth(time, 3.0, duration)
    if back:
        tilt = tilt - smooth(time, 3.3 + duration, duration)
    return math.radians(degrees) * tilt


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize(("degrees", "duration"), [(90.0, 0.1), (180.0, 0.1), (180.0, 0.3)])
@pytest.mark.parametrize("name", PLANAR)
def test_a_turn_beyond_the_gyros_range_is_noticed_and_made_up_for(
    name: str, degrees: float, duration: float, back: bool
) -> None:
    tilt = fast_turn(degrees, duration, back)
    rest = 3.3 + 2.0 * duration if back else 3.0 + duration
    found = run(name, tilt, list(samples(tilt, seed=11)))
    assert found.error.max() > 10.0  # the gyro hides a good part of it
    assert found.wrong_and_trusted() < 1e-3
    assert found.error[found.after(rest + 0.6)].max() < 3.0
    assert found.trusted[found.after(rest + 0.6)].all()


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize(("degrees", "duration"), [(45.0, 0.1), (90.0, 0.2), (180.0, 0.4)])
@pytest.mark.parametrize("name", SELF_JUDGED)
def test_a_filter_that_judges_itself_is_not_trusted_in_a_turn_the_gyro_missed(
    name: str, degrees: float, duration: float, back: bool
) -> None:
    tilt = fast_turn(degrees, duration, back)
    rest = 3.3 + 2.0 * duration if back else 3.0 + duration
    found = run(name, tilt, list(samples(tilt, seed=17)))
    assert found.wrong_and_trusted() < 1e-3
    assert found.trusted[found.after(rest + 0.75)].all()
    assert found.error[found.after(rest + 0.75)].max() < 3.0


@pytest.mark.parametrize("name", SOME)
def test_a_fall_beyond_the_gyros_range_is_made_up_for_at_once(name: str) -> None:
    time = np.arange(0.0, 6.0, DT)
    falling = np.clip((time - 3.0) / 0.18, 0.0, 1.0) ** 2
    tilt = np.asarray(0.6 * falling)
    readings = list(samples(tilt, seed=18))
    assert 5 < sum(sample.gyro_saturated_y for sample in readings) < 15
    found = run(name, tilt, readings)
    assert found.trusted[found.after(3.25)].all()
    assert found.error[found.after(3.25)].max() < 3.0
    assert found.running.restarts == 0


@pytest.mark.parametrize(("slope", "kick", "hold"), [(15.0, 8.0, 0.08), (30.0, 15.0, 0.06)])
@pytest.mark.parametrize("name", SOME)
def test_a_level_rate_beyond_the_range_between_gentle_slopes_has_to_be_confirmed(
    name: str, slope: float, kick: float, hold: float
) -> None:
    time = np.arange(0.0, 8.0, DT)
    up = RANGE / slope + 0.02  # [s]
    end = 3.0 + 2.0 * up + hold
    rate = slope * np.clip(np.minimum(time - 3.0, end - time), 0.0, up)
    rate += kick * ((time >= 3.0 + up) & (time < 3.0 + up + hold))
    tilt = np.cumsum(rate) * DT
    found = run(name, tilt, list(samples(tilt, seed=28)))
    shown = found.after(3.0 + up + hold)
    assert found.error[shown].max() > 15.0
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[shown].any()
    assert found.trusted[found.after(end + 1.0)].all()


@pytest.mark.parametrize("name", SOME)
def test_a_push_beyond_the_range_ends_trust_for_no_longer_than_it_lasts(name: str) -> None:
    time = np.arange(0.0, 8.0, DT)
    rate = np.where(time > 3.0, 4.9 - 35.0 * (time - 3.0), 0.0)  # struck, and caught by the wheels
    rate = np.where(time < 3.2, rate, 0.0)
    tilt = np.cumsum(rate) * DT
    readings = list(samples(tilt, seed=29))
    assert sum(reading.gyro_saturated_y for reading in readings) > 1
    found = run(name, tilt, readings)
    assert found.trusted[found.after(3.04)].all()
    assert found.error[found.after(3.04)].max() < 5.0


@pytest.mark.parametrize("lost", [0.2, 0.4, 0.7])
@pytest.mark.parametrize("name", SOME)
def test_bursts_of_lost_samples_are_no_reason_for_trust(name: str, lost: float) -> None:
    tilt = swing(12.0, degrees=25.0)
    readings = list(samples(tilt, seed=12))
    for start in np.arange(2.0, 8.0, lost / 0.3):
        for index in range(int(start / DT), int((start + lost) / DT)):
            readings[index] = readings[index]._replace(dt=0.0)
    found = run(name, tilt, readings)
    assert not found.trusted.all()
    assert found.wrong_and_trusted() < 1e-3
    assert found.trusted[found.after(11.0)].all()
    dropped = sum(sample.dt == 0.0 for sample in readings)
    assert found.running.lost == pytest.approx(dropped, abs=2)


@pytest.mark.parametrize(("late", "start"), [(0.3, 0.0), (0.9, 0.0), (0.9, 1.2)])
@pytest.mark.parametrize("name", SOME)
def test_a_late_first_sample_hides_no_turn_in_a_gap(name: str, late: float, start: float) -> None:
    tilt = math.radians(70.0) * smooth(np.arange(0.0, 8.0, DT), start, 0.2)
    readings = list(samples(tilt, seed=19))
    for first, lost in ((0.0, late), (start, 0.3)):
        for index in range(int(first / DT) + 1, int((first + lost) / DT)):
            readings[index] = readings[index]._replace(dt=0.0)
    found = run(name, tilt, readings)
    assert found.error.max() > 10.0
    assert found.wrong_and_trusted() < 1e-3
    assert found.trusted[found.after(start + 2.0)].all()


@pytest.mark.parametrize("seconds", [1.0, 3.0])
@pytest.mark.parametrize("name", SOME)
def test_a_saturated_accelerometer_ends_trust_until_it_is_gone(name: str, seconds: float) -> None:
    tilt = swing(12.0)
    full = 2.0 * STANDARD_GRAVITY
    clipped = {"accel_x": full, "accel_z": full, "angle": math.atan2(-full, full)}
    marks = {"accel_saturated_x": 1.0, "accel_saturated_z": 1.0, "angle_variance": 0.1}
    readings = [
        sample._replace(**clipped, **marks) if 3.0 <= index * DT < 3.0 + seconds else sample
        for index, sample in enumerate(samples(tilt, seed=13))
    ]
    found = run(name, tilt, readings)
    assert not found.trusted[(found.time > 3.3) & (found.time < 3.0 + seconds)].any()
    assert found.wrong_and_trusted() < 1e-3
    assert found.error[found.after(3.5 + seconds)].max() < 3.0
    assert found.trusted[found.after(5.0 + seconds)].all()


@pytest.mark.parametrize("name", [*SOME, "ins_odometer"])
def test_a_frozen_sensor_is_not_trusted_and_trust_returns(name: str) -> None:
    tilt = swing(12.0)
    readings = list(samples(tilt, seed=14))
    readings[600:1000] = [readings[600]] * 400
    found = run(name, tilt, readings)
    assert not found.trusted[(found.time > 3.2) & (found.time < 5.0)].any()
    assert found.trusted[found.after(7.5)].all()


@pytest.mark.parametrize("degrees", [0.0, 6.0])
@pytest.mark.parametrize("name", [*SOME, "ins_odometer"])
def test_one_false_rate_is_noticed_with_the_next_sample(name: str, degrees: float) -> None:
    tilt = swing(8.0, degrees)
    readings = list(samples(tilt, seed=30))
    readings[800] = readings[800]._replace(gyro_y=34.0)
    found = run(name, tilt, readings)
    assert found.error[800:802].max() > 4.0
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[found.after(801 * DT)].any()
    assert found.trusted[found.after(801 * DT + 2.0)].all()
    assert found.error[found.after(801 * DT + 2.0)].max() < 5.0


@pytest.mark.parametrize("name", [*SOME, "ins_odometer"])
def test_zeros_of_all_axes_are_not_trusted(name: str) -> None:
    tilt = swing(8.0, degrees=15.0)
    readings = list(samples(tilt, seed=27))
    zeros = dict.fromkeys(("angle", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_z"), 0.0)
    readings[600:740] = [reading._replace(**zeros) for reading in readings[600:740]]
    found = run(name, tilt, readings)
    assert not found.trusted[(found.time > 3.2) & (found.time < 3.7)].any()
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(7.0)].all()


FULL = tuple(name for name in CorrectedSample._fields if "_saturated_" in name)


def silenced(
    readings: list[CorrectedSample], start: float, seconds: float
) -> list[CorrectedSample]:
    """Return the readings with a time in which the chip sends zeros [s]."""
    found, first = list(readings), round(start / DT)
    zeros = dict.fromkeys(READINGS, 0.0) | dict.fromkeys(FULL, 1.0)
    held = {"angle": readings[first - 1].angle, "angle_variance": math.pi**2}
    for index in range(first, first + round(seconds / DT)):
        found[index] = readings[index]._replace(**zeros, **held)
    return found


@pytest.mark.parametrize("seconds", [0.03, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("name", [*PLANAR, "gyro"])
def test_a_silence_is_bridged_by_the_mean_of_the_rates_beside_it(name: str, seconds: float) -> None:
    tilt, end = swing(10.0), 3.0 + seconds
    rate = np.gradient(tilt, DT)
    first, last = round(3.0 / DT) - 1, round(end / DT)
    bridged = 0.5 * (rate[first] + rate[last]) * (last - first) * DT
    left = math.degrees(abs(tilt[last] - tilt[first] - bridged))
    readings = list(samples(tilt, seed=35))
    found, heard = run(name, tilt, silenced(readings, 3.0, seconds)), run(name, tilt, readings)
    after = found.after(end - 0.5 * DT)
    assert found.error[after].max() < left + heard.error[after].max() + 0.3
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(end + 1.0)].all()


@pytest.mark.parametrize("name", SOME)
def test_a_silence_too_long_to_be_bridged_shows_no_rotation(name: str) -> None:
    tilt = math.radians(30.0) * smooth(np.arange(0.0, 10.0, DT), 2.8, 0.4)
    back = math.radians(30.0) * smooth(np.arange(0.0, 10.0, DT), 4.8, 0.4)
    readings = silenced(list(samples(tilt + back, seed=36)), 3.0, 2.0)
    found = run(name, tilt + back, readings)
    assert abs(readings[599].gyro_y) > 2.0 and abs(readings[1000].gyro_y) > 2.0
    assert found.error.max() < 40.0
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(7.0)].all()


@pytest.mark.parametrize("seconds", [0.05, 0.2, 1.5])
@pytest.mark.parametrize("name", SOME)
def test_a_silence_after_a_rate_beyond_the_range_has_to_be_confirmed(
    name: str, seconds: float
) -> None:
    tilt = swing(8.0)
    readings = silenced(list(samples(tilt, seed=40)), 3.0, seconds)
    for index in range(597, 600):
        readings[index] = readings[index]._replace(gyro_y=35.0, gyro_saturated_y=1.0)
    found = run(name, tilt, readings)
    later = found.after(599 * DT)
    assert found.error[later].max() > 20.0
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[later].any()
    assert found.error.max() < 60.0
    assert found.trusted[found.after(4.5 + seconds)].all()


@pytest.mark.parametrize("name", PLANAR)
def test_a_gyro_that_reads_exactly_zero_at_rest_is_believed_after_a_silence(name: str) -> None:
    tilt = np.zeros(1200)
    readings = [each._replace(gyro_y=0.0) for each in samples(tilt, seed=37)]
    found = run(name, tilt, silenced(readings, 3.0, 0.1))
    assert found.trusted[found.after(3.6)].all()


@pytest.mark.parametrize("name", SOME)
def test_a_rate_beyond_the_range_without_slopes_is_forgotten(name: str) -> None:
    tilt = np.zeros(1200)
    full = {"gyro_y": RANGE, "gyro_saturated_y": 1.0}
    readings = [each._replace(gyro_y=0.0) for each in samples(tilt, seed=38)]
    readings[:10] = [each._replace(**full) for each in readings[:10]]
    found = run(name, tilt, readings)
    assert found.trusted[found.after(2.0)].all()


@pytest.mark.parametrize("seconds", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("name", [*PLANAR, "dynamic_planar"])
def test_nobody_steers_by_a_dead_accelerometer(name: str, seconds: float) -> None:
    tilt = swing(8.0)
    corrector = Corrector(Setup(correction=CorrectionSettings(euler=False, centrifugal=False)))
    raw = [
        Sample(DT, 0.0, each.gyro_y, 0.0, each.accel_x, 0.0, each.accel_z)
        for each in samples(tilt, seed=39)
    ]
    for index in range(600, 600 + round(seconds / DT)):
        raw[index] = raw[index]._replace(accel_x=0.0, accel_z=0.0)
    found = run(name, tilt, [corrector.step(each) for each in raw])
    assert found.error.max() < 2.0
    assert not found.trusted[(found.time > 3.2) & (found.time < 3.0 + seconds)].any()
    assert found.trusted[found.after(4.0 + seconds)].all()


@pytest.mark.parametrize("name", SOME)
def test_a_restart_keeps_the_learnt_gyro_bias(name: str) -> None:
    time = np.arange(0.0, 40.0, DT)
    tilt, bias = math.pi * smooth(time, 35.0, 0.1), math.radians(0.5)
    running = WatchedFilter(filter_named(name))
    for sample in samples(tilt, seed=15, bias=bias):
        estimate = running.step(sample)
    assert running.restarts >= 1
    if running.entry.estimates_gyro_bias:
        assert estimate.gyro_bias == pytest.approx(bias, abs=math.radians(0.2))


@pytest.mark.parametrize("name", SOME)
def test_a_motion_that_the_sensors_show_is_left_alone(name: str) -> None:
    tilt = swing(20.0, degrees=20.0)
    found = run(name, tilt, list(samples(tilt, seed=16)))
    assert found.running.restarts == 0
    assert not found.trusted[0]  # it swings already, so that gravity has to confirm it first
    assert found.trusted[found.after(1.0)].all()


@pytest.mark.parametrize("degrees", [0.0, 80.0, 180.0])
@pytest.mark.parametrize("name", SOME)
def test_a_robot_at_rest_is_trusted_from_its_first_sample_on(name: str, degrees: float) -> None:
    tilt = np.full(400, math.radians(degrees))
    assert run(name, tilt, list(samples(tilt, seed=20))).trusted.all()


def pushed(sample: CorrectedSample, acceleration: float) -> CorrectedSample:
    """Return what the accelerometer shows of the same tilt in a push [m/s^2]."""
    x = sample.accel_x + acceleration
    return sample._replace(accel_x=x, angle=math.atan2(-x, sample.accel_z))


@pytest.mark.parametrize("kind", ["zeros", "shaken"])
@pytest.mark.parametrize("name", [*PLANAR, "kalman_tuned"])
def test_a_first_reading_that_misleads_has_to_be_confirmed(name: str, kind: str) -> None:
    tilt = np.full(800, math.radians(80.0 if kind == "zeros" else 0.0))
    readings = list(samples(tilt, seed=21))
    if kind == "zeros":  # of a chip that wakes up
        readings[0] = CorrectedSample(DT, *[0.0] * (len(CorrectedSample._fields) - 1))
    else:
        for index in range(100):
            push = 4.0 * math.cos(2.0 * math.pi * 4.0 * index * DT)
            readings[index] = pushed(readings[index], push)
    found = run(name, tilt, readings)
    assert found.error[0] > 20.0
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(2.0)].all()


def test_a_tilt_that_went_round_the_circle_is_within_half_a_turn() -> None:
    watched = WatchedFilter(filter_named("gyro"), {}, Robot())
    for index in range(400):
        angle = math.remainder(index * 0.05, 2.0 * math.pi)
        spun = CorrectedSample(*([0.0] * len(CorrectedSample._fields)))._replace(
            dt=0.005, angle=angle, gyro_y=10.0, accel_x=-9.8 * math.sin(angle),
            accel_z=9.8 * math.cos(angle), angle_variance=1e-4,
        )  # fmt: skip
        assert abs(watched.step(spun).tilt) <= math.pi
    assert abs(watched.state.tilt) > math.pi


@pytest.mark.parametrize("bias", [0.17, -0.35])
@pytest.mark.parametrize("name", [*PLANAR, "kalman_tuned"])
def test_a_gyro_bias_is_learnt_at_rest_or_the_tilt_is_not_trusted(name: str, bias: float) -> None:
    tilt = np.full(2000, 0.02)
    found = run(name, tilt, list(samples(tilt, seed=22, bias=bias)))
    later = found.after(1.2)
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[later].any()
    assert bool(found.trusted[-1]) == found.running.entry.estimates_gyro_bias
    assert found.error[-1] < 5.0 or not found.running.entry.estimates_gyro_bias


@pytest.mark.parametrize("name", [*SOME, "kalman"])
def test_a_rest_shows_a_gyro_bias_through_a_noisy_accelerometer(name: str) -> None:
    tilt = np.full(2000, 0.02)
    found = run(name, tilt, list(samples(tilt, seed=28, bias=0.2, accel_noise=0.2)))
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[found.after(2.0)].any()
    assert bool(found.trusted[-1]) == found.running.entry.estimates_gyro_bias


@pytest.mark.parametrize("name", SOME)
def test_a_bias_that_comes_long_after_any_cause_of_doubt_is_noticed(name: str) -> None:
    tilt = np.full(7000, 0.02)
    good, bad = (list(samples(tilt, seed=23, bias=bias)) for bias in (0.0, 0.2))
    found = run(name, tilt, good[:5000] + bad[5000:])
    later = found.after(27.5)
    assert found.trusted[: 5000 - 1].all()
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[later].any()


@pytest.mark.parametrize("name", SOME)
def test_a_bias_ignored_at_rest_is_not_trusted_in_motion(name: str) -> None:
    resting, tilt = np.zeros(600), swing(10.0)
    both = np.concatenate([resting, tilt])
    found = run(name, both, list(samples(both, seed=24, bias=0.17)))
    later = found.after(1.2)
    assert not ((found.error > 5.0) & (found.trusted > 0.0))[later].any()


@pytest.mark.parametrize("name", SOME)
def test_a_slow_turn_is_no_bias(name: str) -> None:
    tilt = 0.05 * np.arange(0.0, 10.0, DT)
    found = run(name, tilt, list(samples(tilt, seed=25)))
    assert found.running.restarts == 0 and found.trusted.all()


@pytest.mark.parametrize("phase", np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False).tolist())
@pytest.mark.parametrize("name", [*SOME, "kalman"])
def test_a_robot_that_sways_in_a_hand_shows_no_bias(name: str, phase: float) -> None:
    """One second of a slow sway can look like a rest, in which the gyro turns."""
    time = np.arange(0.0, 30.0, DT)
    tilt = 0.03 * np.sin(2.0 * math.pi * 0.45 * time + phase)
    push = 0.6 * np.sin(2.0 * math.pi * 0.5 * time)
    readings = [pushed(*each) for each in zip(samples(tilt, seed=27), push.tolist(), strict=True)]
    found = run(name, tilt, readings)
    assert found.running.restarts == 0
    assert found.error.max() < 5.0


@pytest.mark.parametrize("name", SOME)
def test_a_first_reading_in_a_long_push_is_corrected_at_rest(name: str) -> None:
    tilt = np.zeros(1000)
    readings = list(samples(tilt, seed=26))
    readings[:60] = [pushed(reading, 4.0) for reading in readings[:60]]
    found = run(name, tilt, readings)
    assert found.error[0] > 20.0
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(2.0)].all()


def test_a_start_in_a_shaking_hand_is_not_trusted_before_it_rests() -> None:
    tilt = np.zeros(1200)
    readings = list(samples(tilt, seed=31))
    for index in range(600):
        push = 4.0 * math.cos(2.0 * math.pi * 0.8 * index * DT)
        readings[index] = pushed(readings[index], push)
    found = run("complementary", tilt, readings)
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(4.5)].all()


def turned_about(
    readings: list[CorrectedSample], rate: FloatArray, radius: float, ratio: float
) -> list[CorrectedSample]:
    """Return the readings of a sensor on a circle, and wheels that turn `ratio` times as fast."""
    found, turned = [], np.cumsum(rate) * DT
    for sample, each, angle in zip(readings, rate.tolist(), turned.tolist(), strict=True):
        moved = pushed(sample, each * each * radius)
        wheels = {"wheel_difference": ratio * angle, "wheel_count": 2.0}
        found.append(moved._replace(gyro_z=each, **wheels))
    return found


@pytest.mark.parametrize("begins", [-2.0, 3.0])
@pytest.mark.parametrize("name", [*SOME, "kalman"])
def test_a_turntable_leans_the_accelerometer_and_is_not_believed(name: str, begins: float) -> None:
    time = np.arange(0.0, 20.0, DT)
    rate = 2.5 * (smooth(time, begins, 1.0) - smooth(time, 14.0, 1.0))
    tilt = np.zeros(time.size)
    found = run(name, tilt, turned_about(list(samples(tilt, seed=33)), rate, 0.3, 0.0))
    assert found.error.max() > 8.0
    assert found.wrong_and_trusted() == 0.0
    assert found.trusted[found.after(17.0)].all()


@pytest.mark.parametrize("encoders", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("name", [*SOME, "kalman"])
def test_a_robot_that_turns_by_itself_is_trusted(name: str, encoders: float) -> None:
    time = np.arange(0.0, 20.0, DT)
    rate = 2.5 * (smooth(time, 3.0, 1.0) - smooth(time, 14.0, 1.0))
    tilt = np.zeros(time.size)
    readings = [
        each._replace(wheel_count=encoders, gyro_y=each.gyro_y + 0.005 * each.gyro_z)
        for each in turned_about(list(samples(tilt, seed=34)), rate, 0.01, 2.0)
    ]
    found = run(name, tilt, readings)
    assert found.trusted.all()
    assert found.error.max() < 2.0
