"""Sensors that contradict each other on a live stream."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import twbr_estimation as twbr
from twbr_estimation.checks.quick import QuickChecks
from twbr_estimation.samples import STANDARD_GRAVITY, CorrectedSample

DT = 0.005
ZERO = CorrectedSample(**dict.fromkeys(CorrectedSample._fields, 0.0))


def swing(seconds: float, amplitude: float = 0.3, seed: int = 7) -> Iterator[CorrectedSample]:
    """Yield what an IMU with noise reads on a swing at 1 Hz."""
    noise = np.random.default_rng(seed)
    for index in range(round(seconds / DT)):
        phase = 2.0 * math.pi * index * DT
        tilt, rate = amplitude * math.sin(phase), amplitude * 2.0 * math.pi * math.cos(phase)
        force = STANDARD_GRAVITY * np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
        x, y, z = force + 0.05 * noise.standard_normal(3)
        yield ZERO._replace(
            dt=DT, gyro_y=rate + 0.002 * noise.standard_normal(), accel_x=x, accel_y=y, accel_z=z
        )


def checked(
    change: Callable[[CorrectedSample], CorrectedSample], seconds: float = 3.0, **how: float
) -> QuickChecks:
    checks = QuickChecks()
    for sample in swing(seconds, **how):  # type: ignore[arg-type]
        checks.add(change(sample))
    return checks


@pytest.mark.parametrize("amplitude", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_sensors_that_agree_are_trusted(amplitude: float, seed: int) -> None:
    checks = checked(lambda each: each, amplitude=amplitude, seed=seed)
    assert checks.untrusted == () and checks.doubts == ()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: s._replace(gyro_y=0.0), "gyro: axis y reads 0 rad/s"),
        (lambda s: s._replace(gyro_y=4.36), "gyro: axis y reads 4.36"),
        (lambda s: s._replace(accel_x=0.0, accel_z=9.8), "accelerometer: axis x reads 0"),
        (lambda s: s._replace(gyro_y=math.degrees(s.gyro_y)), "deg/s"),
        (lambda s: s._replace(gyro_y=-s.gyro_y), "sign"),
        (lambda s: s._replace(accel_x=-s.accel_x), "sign"),
    ],
)
def test_a_sensor_that_contradicts_the_other_is_not_trusted(
    change: Callable[[CorrectedSample], CorrectedSample], said: str
) -> None:
    checks = checked(change)
    assert len(checks.untrusted) == 1 and said in checks.untrusted[0].sentence


def in_g(sample: CorrectedSample) -> CorrectedSample:
    x, y, z = (each / STANDARD_GRAVITY for each in sample[6:9])
    return sample._replace(accel_x=x, accel_y=y, accel_z=z)


def upside_down(sample: CorrectedSample) -> CorrectedSample:
    """Turned about x by half a turn: what a board mounted face down reads."""
    return sample._replace(gyro_y=-sample.gyro_y, accel_y=-sample.accel_y, accel_z=-sample.accel_z)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (in_g, "it is in g"),
        (lambda s: s._replace(accel_z=1.5 * s.accel_z), "where gravity is 9.81"),
        (lambda s: s._replace(accel_x=0.001, accel_y=0.0, accel_z=0.02), "mean reading is 0.02"),
        (upside_down, "z axis points down"),
    ],
)
def test_a_wrong_accelerometer_is_named(
    change: Callable[[CorrectedSample], CorrectedSample], said: str
) -> None:
    checks = checked(change, amplitude=0.02)
    assert any(said in each.sentence for each in checks.doubts)


def test_trust_returns_two_seconds_after_good_samples() -> None:
    checks = checked(lambda each: each._replace(gyro_y=0.0))
    assert checks.untrusted
    for sample in swing(2.2):
        checks.add(sample)
    assert checks.untrusted == ()


def wobble(
    seconds: float, amplitude: float = 0.05, length: float = 0.3
) -> Iterator[CorrectedSample]:
    """Yield what the IMU on the axle of a balancing robot reads while it wobbles at 1.2 Hz.

    An inverted pendulum whose `length` is that of its equivalent point mass [m] follows the
    wobble only with the axle accelerating by g tilt - length * angular acceleration.
    """
    noise, omega = np.random.default_rng(8), 2.0 * math.pi * 1.2
    for index in range(round(seconds / DT)):
        tilt = amplitude * math.sin(omega * index * DT)
        rate = amplitude * omega * math.cos(omega * index * DT)
        push = (STANDARD_GRAVITY + length * omega**2) * tilt
        x = push * math.cos(tilt) - STANDARD_GRAVITY * math.sin(tilt)
        z = push * math.sin(tilt) + STANDARD_GRAVITY * math.cos(tilt)
        x, y, z = np.array([x, 0.0, z]) + 0.05 * noise.standard_normal(3)
        yield ZERO._replace(dt=DT, gyro_y=rate, accel_x=x, accel_y=y, accel_z=z)


@pytest.mark.parametrize("amplitude", [0.02, 0.05, 0.1])
def test_a_robot_that_wobbles_as_it_balances_has_the_right_sign(amplitude: float) -> None:
    checks, samples = QuickChecks(), list(wobble(10.0, amplitude))
    for sample in samples:
        checks.add(sample)
        assert checks.untrusted == ()
    lean = [math.atan2(-each.accel_x, each.accel_z) for each in samples]
    turn = np.cumsum([each.gyro_y * DT for each in samples])
    assert np.corrcoef(lean, turn)[0, 1] < -0.9, "or the accelerometer does not swing against it"


@pytest.mark.parametrize("scene", ["drive", "jerking"])
@pytest.mark.parametrize("world", ["paper", "W4"])
def test_a_driving_robot_has_the_right_sign(world: str, scene: str) -> None:
    checks = QuickChecks()
    drive = twbr.simulate(world, seed=9702, dt=0.005, duration=30.0, scene=scene)
    for row in drive.corrected_samples.columns.T.tolist():
        checks.add(CorrectedSample(*row))
        assert checks.untrusted == ()


def test_a_wrong_sign_is_remembered_at_rest_and_forgotten_by_a_right_swing() -> None:
    checks = checked(lambda each: each._replace(gyro_y=-each.gyro_y))
    for sample in swing(5.0, amplitude=0.0):
        checks.add(sample)
    assert [each.check for each in checks.untrusted] == ["sign"]
    for sample in swing(3.0):
        checks.add(sample)
    assert checks.untrusted == ()


def in_degrees(sample: CorrectedSample) -> CorrectedSample:
    return sample._replace(gyro_y=math.degrees(sample.gyro_y))


def test_a_gyro_in_degrees_is_remembered_at_rest_and_forgotten_by_a_right_swing() -> None:
    checks = checked(in_degrees)
    for sample in swing(5.0, amplitude=0.0):
        checks.add(in_degrees(sample))
    assert [each.check for each in checks.untrusted] == ["unit"]
    for sample in swing(3.0):
        checks.add(sample)
    assert checks.untrusted == ()


def in_g_less_a_bias(sample: CorrectedSample) -> CorrectedSample:
    return in_g(sample)._replace(accel_z=in_g(sample).accel_z + 0.5)


@pytest.mark.parametrize("change", [in_g, in_g_less_a_bias])
def test_an_accelerometer_in_g_is_not_trusted_until_it_reads_gravity(
    change: Callable[[CorrectedSample], CorrectedSample],
) -> None:
    checks = checked(change, amplitude=0.02)
    assert [each.subject for each in checks.untrusted] == ["accelerometer"]
    for sample in swing(3.0, amplitude=0.02):
        checks.add(sample)
    assert checks.untrusted == ()
