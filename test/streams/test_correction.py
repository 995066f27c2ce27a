"""The live correction: equal to the batch, and robust against what a robot does to it."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from twbr_estimation.batch.running import correct_compiled
from twbr_estimation.pipeline.pairing import WheelReading, motor_command, pair
from twbr_estimation.robot import Calibration, CorrectionSettings, Robot, Setup
from twbr_estimation.samples import RESTART_GAP, CorrectedSample, is_saturated
from twbr_estimation.streams.corrected import CorrectedStream, has_angle, imu_values
from twbr_estimation.streams.correction import CorrectionStream, StampedSamples

SETUP = Setup(
    Robot(mounting=(0.01, -0.02, 0.03)),
    Calibration(gyro_bias=(0.01, -0.02, 0.005), accel_scale_x=(0.01, 1e-4)),
    CorrectionSettings(),
)


def events(driven: Any) -> Iterator[tuple[int, Any]]:
    """Yield both streams' readings by stamp."""
    imu = (
        (int(stamp), 1, tuple(map(float, [*gyro, *accel])))
        for stamp, gyro, accel in zip(*driven.imu_columns, strict=True)
    )
    wheels = (
        (int(s), 0, WheelReading(int(s), 0.5 * (a + b), b - a, 2.0))
        for s, (a, b) in zip(driven.wheels.stamps, driven.wheels.angle.tolist(), strict=True)
    )
    for stamp, _, reading in heapq.merge(imu, wheels):
        yield stamp, reading


def feed(stream: Any, readings: Any) -> StampedSamples:
    ready: StampedSamples = []
    for stamp, reading in readings:
        if isinstance(reading, WheelReading):
            ready += stream.add_wheels(reading)
        else:
            ready += stream.add_imu(stamp, reading)
    return ready


def test_live_equals_batch(driven: Any) -> None:
    stream = CorrectionStream(SETUP)
    live = feed(stream, events(driven)) + stream.flush()
    offline = correct_compiled(pair(driven.imu, driven.wheels), SETUP)
    assert [stamp for stamp, _ in live] == driven.imu.stamps.tolist()
    columns = np.array([sample for _, sample in live]).T
    np.testing.assert_allclose(columns, offline.columns, rtol=1e-12, atol=1e-12)
    assert stream.counts["samples"] == driven.imu.stamps.size


def test_samples_survive_the_way_through_an_imu_message(driven: Any) -> None:
    stream = CorrectionStream(SETUP)
    wheels = [reading for _, reading in events(driven) if isinstance(reading, WheelReading)]
    direct = feed(stream, events(driven)) + stream.flush()
    received = CorrectedStream()
    received.paired = True
    ready: StampedSamples = []
    for reading in wheels:
        ready += received.add_wheels(reading)
    for stamp, s in direct:
        values = tuple(imu_values(s, s.angle, s.angle_variance, s.gyro_y))
        assert has_angle(values)
        ready += received.add_imu(stamp, values)
    ready += received.flush()
    assert [stamp for stamp, _ in ready] == [stamp for stamp, _ in direct]
    there = np.array([sample for _, sample in direct])
    back = np.array([sample for _, sample in ready])
    np.testing.assert_allclose(back, there, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_readings_that_are_not_finite_are_skipped_and_counted(driven: Any, bad: float) -> None:
    readings = list(events(driven))
    stream = CorrectionStream(SETUP)
    before = feed(stream, readings[:100])
    stamp = readings[100][0]
    assert stream.add_imu(stamp, (0.0, bad, 0.0, 0.0, 0.0, 9.8)) == []
    assert stream.add_wheels(WheelReading(stamp, bad, 0.0, 1.0)) == []
    after = feed(stream, readings[100:]) + stream.flush()
    assert len(before) + len(after) == driven.imu.stamps.size
    assert all(np.isfinite(sample).all() for _, sample in after)
    assert stream.imu_guard.counts["not_finite"] == 1
    assert stream.wheel_guard.counts["not_finite"] == 1


def test_a_looped_recording_gives_the_same_every_time(driven: Any) -> None:
    stream = CorrectionStream(SETUP)
    once = [*events(driven)]
    first = feed(stream, once)
    second = feed(stream, once)
    held = len(once) - 500 - len(first)
    assert held >= 0
    again = second[held:] + stream.flush()
    assert [stamp for stamp, _ in again] == driven.imu.stamps.tolist()
    assert again[0][1].dt > RESTART_GAP
    beginning = [(s, c) for s, c in first[1:]]
    assert again[1 : len(first)] == beginning
    assert stream.imu_guard.counts["restart"] == 1


def test_a_dead_encoder_degrades_and_recovers(driven: Any) -> None:
    stream = CorrectionStream(SETUP)
    dead = (driven.imu.stamps[300], driven.imu.stamps[700])
    ready = feed(
        stream,
        (
            (stamp, reading)
            for stamp, reading in events(driven)
            if not (isinstance(reading, WheelReading) and dead[0] < stamp < dead[1])
        ),
    )
    ready += stream.flush()
    known = np.array([sample.wheel_count > 0.0 for _, sample in ready])
    assert known.size == driven.imu.stamps.size  # not one sample is lost
    assert known[1:300].all() and not known[500:690].any() and known[710:].all()
    assert stream.counts["without_wheels"] == np.count_nonzero(~known)
    assert stream.wheels_known


def test_saturated_readings_pass_with_a_large_variance() -> None:
    stream = CorrectionStream(Setup())
    (quiet,) = stream.add_imu(10**9, (0.0, 0.0, 0.0, 0.0, 0.0, 9.8)) + stream.flush()
    (hit,) = stream.add_imu(10**9 + 10**6, (0.0, 4.37, 0.0, 19.7, 0.0, 9.8)) + stream.flush()
    assert hit[1].gyro_variance_y > 100.0 * quiet[1].gyro_variance_y
    assert hit[1].angle_variance > 100.0 * quiet[1].angle_variance
    assert stream.counts["saturated"] == 1


@pytest.mark.parametrize("gyro_range", [125.0, 250.0, 2000.0])
@pytest.mark.parametrize("mounting", [(0.0, 0.0, 0.0), (0.2, -0.4, 0.3), (0.7, 0.6, 0.8)])
def test_what_is_saturated_survives_the_message(
    gyro_range: float, mounting: tuple[float, float, float]
) -> None:
    """At every sensor axis, single and combined for a slower loop."""
    setup = Setup(Robot(mounting=mounting, gyro_range=math.radians(gyro_range)))
    full = [setup.robot.gyro_range] * 3 + [setup.robot.accel_range] * 3
    for axis in range(6):
        reading = [0.01, 0.02, -0.01, 0.2, 0.1, 9.8]
        quiet = tuple(reading)
        reading[axis] = full[axis]
        for readings in ([tuple(reading)] * 21, [quiet] * 20 + [tuple(reading)]):
            for period in (0.0, 0.01):
                stream, received = (
                    CorrectionStream(setup, 0.0, loop_period=period),
                    CorrectedStream(),
                )
                saturated = 0
                for index, values in enumerate(readings):
                    for stamp, sent in stream.add_imu(10**9 + index * 10**6, values):
                        message = imu_values(sent, sent.angle, sent.angle_variance, sent.gyro_y)
                        ((_, got),) = received.add_imu(stamp, tuple(message))
                        assert got._replace(dt=0.0, angle=0.0) == sent._replace(dt=0.0, angle=0.0)
                        saturated += is_saturated(got)
                assert saturated > 0


def test_the_setup_changes_between_two_samples(driven: Any) -> None:
    stream = CorrectionStream(Setup(), wait=0.0)
    readings = [(stamp, r) for stamp, r in events(driven) if not isinstance(r, WheelReading)]
    before = feed(stream, readings[:10])
    stream.configure(Setup(calibration=Calibration(gyro_bias=(0.0, 1.0, 0.0))))
    after = feed(stream, readings[10:20])
    raw = [reading[1] for _, reading in readings[:20]]
    rates = [sample.gyro_y for _, sample in before + after]
    assert rates[:10] == raw[:10]
    np.testing.assert_allclose(rates[10:], np.array(raw[10:]) - 1.0, atol=1e-12)


def test_corrected_messages_without_their_wheels_pass_at_once() -> None:
    stream = CorrectedStream()
    sample = CorrectedSample(*[0.1] * len(CorrectedSample._fields))
    values = tuple(imu_values(sample, 0.1, 0.2, 0.3))
    for index in range(3):
        ((stamp, received),) = stream.add_imu(10**9 + index * 10**6, values)
        assert received.angle == pytest.approx(0.1, abs=1e-15)
        assert received.dt == pytest.approx(0.001 * (index > 0))
    assert stream.add_imu(stamp, values) == []
    assert stream.imu_guard.counts == {"repeated_stamp": 1}


def test_corrected_messages_get_the_command_before_them() -> None:
    stream, raw = CorrectedStream(), CorrectionStream(Setup(), wait=0.0)
    stream.paired = True
    sample = CorrectedSample(*[0.1] * len(CorrectedSample._fields))
    values = tuple(imu_values(sample, 0.1, 0.2, 0.3))
    for each in (stream, raw):
        each.add_motors(motor_command(10**9, [1.0, 4.0]))
        each.add_motors(motor_command(2 * 10**9, [3.0]))
    found = []
    for stamp in (10**9, 10**9 + 1, 2 * 10**9, 2 * 10**9 + 1):
        found += stream.add_imu(stamp, values) + stream.flush()
    assert [(each.voltage, each.voltage_difference, each.motor_count) for _, each in found] == [
        (0.0, 0.0, 0.0),
        (2.5, 3.0, 2.0),
        (2.5, 3.0, 2.0),
        (3.0, 0.0, 1.0),
    ]
    ((_, corrected),) = raw.add_imu(10**9 + 1, (0.0, 0.0, 0.0, 0.0, 0.0, 9.8)) + raw.flush()
    assert (corrected.voltage, corrected.voltage_difference, corrected.motor_count) == (
        2.5,
        3.0,
        2.0,
    )
