"""A robot that balances quietly, at 5 deg/s: faults are found, or said to be undecided."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.check import check
from twbr_estimation.checks.finding import Finding, Severity, noteworthy
from twbr_estimation.recording import ImuTrack, Recording, TiltTrack, WheelTrack
from twbr_estimation.robot import Calibration, Robot, Setup
from twbr_estimation.samples import STANDARD_GRAVITY

DT, SECONDS, RADIUS, HEIGHT, PENDULUM = 0.005, 40.0, 0.0375, 0.15, 0.12
RATE = math.radians(5.0)
COUNT = 2.0 * math.pi / 1320
SETUP = Setup(
    Robot(lever_arm=(0.0, 0.0, HEIGHT), wheel_radius=RADIUS), Calibration(gyro_bias=(0, 0.02, 0))
)


def balancing(seed: int, height: float = HEIGHT) -> Recording:
    """Return an upright pendulum on wheels that follows a sum of sines; small angles.

    Balancing ties tilt and acceleration: x'' = g phi - l phi'', so the accelerometer in the
    place of the IMU reads hardly anything forward.
    """
    noise = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, DT)
    speed = 2.0 * math.pi * noise.uniform(0.4, 2.5, 12)
    size = noise.uniform(0.3, 1.0, 12) / speed
    size *= RATE / math.sqrt(np.sum(np.square(size * speed)) / 2.0)
    angle = speed * time[:, None] + noise.uniform(0.0, 6.3, 12)
    tilt, rate = np.sin(angle) @ size, np.cos(angle) @ (size * speed)
    bending = -np.sin(angle) @ (size * speed**2)
    place = np.sin(angle) @ (-size * (STANDARD_GRAVITY / speed**2 + PENDULUM))
    gyro, accel = 0.0018 * noise.standard_normal((2, time.size, 3)) * [[[1.0]], [[22.0]]]
    gyro[:, 1] += rate + 0.02
    accel[:, 0] += (height - PENDULUM) * bending
    accel[:, 2] += STANDARD_GRAVITY
    wheels = np.floor((place / RADIUS - tilt) / COUNT) * COUNT
    stamps = np.arange(time.size, dtype=np.int64) * round(DT * 1e9)
    return Recording(
        "quiet",
        ImuTrack(stamps, gyro, accel),
        WheelTrack(stamps, np.stack([wheels, wheels], axis=1)),
        TiltTrack(stamps, tilt),
    )


@pytest.fixture(scope="module", params=[1, 2])
def quiet(request: pytest.FixtureRequest) -> Recording:
    return balancing(request.param)


def found(recording: Recording, setup: Setup = SETUP) -> dict[str, Finding]:
    return {f"{each.subject} {each.check}": each for each in noteworthy(check(recording, setup))}


def imu(
    recording: Recording, gyro: float = 1.0, accel: tuple[float, ...] = (1.0, 1.0, 1.0)
) -> tuple[Recording, Setup]:
    calibration = Calibration(gyro_bias=(0.0, 0.02 * gyro, 0.0))
    track = replace(
        recording.imu, gyro=recording.imu.gyro * gyro, accel=recording.imu.accel * accel
    )
    return replace(recording, imu=track), replace(SETUP, calibration=calibration)


def wheels(recording: Recording, by: Callable[[np.ndarray], np.ndarray]) -> Recording:
    assert recording.wheels is not None
    return replace(recording, wheels=replace(recording.wheels, angle=by(recording.wheels.angle)))


def test_nothing_is_found_in_a_quiet_robot(quiet: Recording) -> None:
    assert found(quiet) == {}
    assert found(replace(quiet, reference=None)) == {}


@pytest.mark.parametrize("with_reference", [True, False])
@pytest.mark.parametrize(
    ("factor", "key"), [(-1.0, "gyro sign"), (180.0 / math.pi, "gyro unit"), (0.1, "gyro unit")]
)
def test_a_wrong_gyro_is_found(
    quiet: Recording, factor: float, key: str, with_reference: bool
) -> None:
    recording, setup = imu(quiet, gyro=factor)
    told = found(recording if with_reference else replace(recording, reference=None), setup)
    assert told[key].ratio == pytest.approx(factor, rel=0.1)


@pytest.mark.parametrize(
    ("factors", "key", "ratio"),
    [
        ((-1.0, -1.0), "wheels sign", -1.0),
        ((-1.0, 1.0), "wheels sign", None),
        ((57.3, 57.3), "wheels scale", 57.3),
        ((0.25, 0.25), "wheels scale", 0.25),
        ((4.0, 4.0), "wheels scale", 4.0),
        ((57.3, 1.0), "wheels scale", 57.3),
    ],
)
def test_wrong_wheels_are_found(
    quiet: Recording, factors: tuple[float, float], key: str, ratio: float | None
) -> None:
    told = found(wheels(replace(quiet, reference=None), lambda angle: angle * factors))
    assert key in told, told
    assert ratio is None or told[key].ratio == pytest.approx(ratio, rel=0.1)


def test_a_wrong_reference_is_found(quiet: Recording) -> None:
    assert quiet.reference is not None
    backward = replace(quiet, reference=replace(quiet.reference, tilt=-quiet.reference.tilt))
    assert "so the reference has the wrong sign" in found(backward)["reference scale"].text


def test_what_cannot_be_decided_is_said() -> None:
    """An IMU at the pendulum's length reads nothing forward: its sign does not show."""
    quiet = balancing(3, height=PENDULUM)
    setup = replace(SETUP, robot=replace(SETUP.robot, lever_arm=(0.0, 0.0, PENDULUM)))
    for recording in (quiet, imu(quiet, accel=(-1.0, 1.0, 1.0))[0]):
        skipped = [each for each in check(recording, setup) if each.severity is Severity.SKIP]
        (signs,) = (each for each in skipped if each.check == "signs")
        assert "accelerometer's x axis" in signs.text and "gyro" not in signs.text


def test_two_causes_that_fit_alike_are_both_named() -> None:
    quiet = replace(balancing(3, height=PENDULUM), reference=None)
    setup = replace(SETUP, robot=replace(SETUP.robot, lever_arm=(0.0, 0.0, PENDULUM)))
    (only,) = noteworthy(check(wheels(quiet, lambda angle: -angle), setup))
    assert "cannot distinguish this from: " in only.text
    assert {"gyro", "wheels"} <= {only.subject, only.text.partition("this from: ")[2].split(":")[0]}


@pytest.mark.parametrize("counts", [12, 24])
def test_coarse_wheels_are_named_and_nothing_else(quiet: Recording, counts: int) -> None:
    step = 2.0 * math.pi / counts
    told = found(wheels(quiet, lambda angle: np.floor(angle / step) * step))
    assert list(told) == ["wheels resolution"]
    assert told["wheels resolution"].ratio == pytest.approx(step)


@pytest.mark.parametrize("scale", [0.87, 1.13])
def test_an_accelerometer_13_percent_off_is_found(quiet: Recording, scale: float) -> None:
    told = found(*imu(quiet, accel=(scale,) * 3))
    assert told["accelerometer gravity"].ratio == pytest.approx(scale, rel=0.01)


def test_wheels_that_stand_still_while_the_robot_balances_are_dead(quiet: Recording) -> None:
    assert "wheels dead" in found(wheels(quiet, lambda angle: 0.0 * angle))
