"""The live acceptance test without ROS: steps, faults of each step, and the end."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.finding import Finding, Severity, noteworthy
from twbr_estimation.pipeline.pairing import wheel_reading
from twbr_estimation.recording import Recording
from twbr_estimation.robot import Setup
from twbr_estimation.simulation import Simulated, simulate
from twbr_estimation.streams.acceptance import WATCH, Acceptance, AcceptanceSettings
from twbr_estimation.streams.acceptance_steps import steps

G = 9.80665
PERIOD = 0.01
SETTINGS = AcceptanceSettings(seconds=8.0, patience=5.0)


class Person:
    """Does with a sensor whatever is asked for; faults are functions of rates and angles."""

    def __init__(self, acceptance: Acceptance, gyro: object = None, wheels: object = None) -> None:
        self.acceptance = acceptance
        self.time = 1.0
        self.tilt = self.left = self.right = 0.0
        self.gyro = gyro or (lambda rate: (0.0, rate, 0.0))
        self.wheels = wheels or (lambda left, right: (left, right))
        self.accel_sign = 1.0
        self.noise = np.random.default_rng(7)

    def go(self, seconds: float, rate: float = 0.0, left: float = 0.0, right: float = 0.0) -> None:
        """Move for a while: rates of the body and of the wheels [rad/s]."""
        for index in range(round(seconds / PERIOD)):
            self.time += PERIOD
            self.tilt += rate * PERIOD
            self.left, self.right = self.left + left * PERIOD, self.right + right * PERIOD
            stamp = round(self.time * 1e9)
            force = (-self.accel_sign * G * math.sin(self.tilt), 0.0, G * math.cos(self.tilt))
            exact = np.array([*self.gyro(rate), *force])
            values = exact + self.noise.normal(0.0, [0.001] * 3 + [0.02] * 3)
            self.acceptance.add_wheels(wheel_reading(stamp, self.wheels(self.left, self.right)))
            self.acceptance.add_imu(stamp, tuple(values.tolist()))
            if index % 20 == 0:
                self.acceptance.look(self.time)

    def follow(self) -> None:
        """Do the four steps."""
        self.go(4.0)
        self.go(1.5, left=2.0)
        self.go(1.0)
        self.go(1.5, right=2.0)
        self.go(1.0)
        self.go(0.5, rate=0.7)
        self.go(1.0)


def findings(acceptance: Acceptance) -> dict[str, Finding]:
    return {f"{each.subject} {each.check}": each for each in noteworthy(acceptance.found)}


def test_all_steps_are_fulfilled_by_what_is_seen() -> None:
    acceptance = Acceptance(Setup(), SETTINGS)
    person = Person(acceptance)
    person.go(0.5)
    assert acceptance.request == steps()[0].request
    person.follow()
    assert acceptance.request == WATCH and findings(acceptance) == {}
    assert {each.check for each in acceptance.found} >= {"noise", "bias", "sign", "lean"}


@pytest.mark.parametrize(
    ("gyro", "wheels", "key"),
    [
        (None, lambda left, right: (-left, right), "wheels sign"),
        (None, lambda left, right: (left, -right), "wheels sign"),
        (None, lambda left, right: (right, left), "wheels sides"),
        (lambda rate: (0.0, -rate, 0.0), None, "gyro sign"),
        (lambda rate: (rate, 0.0, 0.0), None, "gyro axes"),
        (lambda rate: (0.0, math.degrees(rate), 0.0), None, "gyro unit"),
    ],
)
def test_a_step_finds_its_fault(gyro: object, wheels: object, key: str) -> None:
    acceptance = Acceptance(Setup(), SETTINGS)
    Person(acceptance, gyro, wheels).follow()
    assert set(findings(acceptance)) == {key}
    assert findings(acceptance)[key].severity is Severity.FAIL


def test_an_accelerometer_that_points_backward_is_found() -> None:
    acceptance = Acceptance(Setup(), SETTINGS)
    person = Person(acceptance)
    person.accel_sign = -1.0
    person.follow()
    assert set(findings(acceptance)) == {"accelerometer sign"}


def test_steps_not_carried_out_are_skipped_and_it_ends() -> None:
    acceptance = Acceptance(Setup(), SETTINGS)
    Person(acceptance).go(30.0)
    assert acceptance.ended
    skipped = [each.check for each in acceptance.found if each.subject == "step"]
    assert skipped == ["left wheel", "right wheel", "lean"]


def test_samples_before_the_first_look_are_watched_too() -> None:
    acceptance = Acceptance(Setup(), replace(SETTINGS, ask=False))
    recording = simulate("W4", PERIOD, SETTINGS.seconds + 0.1, 511).recording
    columns = (recording.imu.stamps.tolist(), recording.imu.gyro, recording.imu.accel)
    for stamp, gyro, accel in zip(*columns, strict=True):
        acceptance.add_imu(stamp + 1, (*gyro.tolist(), *accel.tolist()))
    for index in range(5):
        acceptance.look(0.2 * index)
    assert acceptance.ended and "clock" not in {each.check for each in acceptance.found}


def test_without_data_it_ends_with_a_failure() -> None:
    acceptance = Acceptance(Setup(), SETTINGS)
    for now in (0.0, 4.0, 6.0):
        acceptance.look(now)
    assert acceptance.ended and set(findings(acceptance)) == {"IMU presence"}


def test_stamps_that_hardly_advance_are_a_failure() -> None:
    acceptance = Acceptance(Setup(), replace(SETTINGS, ask=False))
    for index in range(1, 200):
        acceptance.add_imu(index * 10_000, (0.0, 0.0, 0.0, 0.0, 0.0, G))
        acceptance.look(index * 0.1)
    assert acceptance.ended and findings(acceptance)["IMU clock"].severity is Severity.FAIL


def test_bad_readings_are_counted() -> None:
    acceptance = Acceptance(Setup(), SETTINGS)
    acceptance.add_imu(0, (0.0,) * 6)
    acceptance.add_imu(5, (math.nan,) * 6)
    acceptance.add_imu(5, (0.0,) * 6)
    acceptance.add_imu(5, (0.0,) * 6)
    assert acceptance.counts.total() == 3


@pytest.fixture(scope="module")
def drive() -> Simulated:
    return simulate("W4", 0.005, 20.0, 411)


def watched(recording: Recording, setup: Setup) -> Acceptance:
    acceptance = Acceptance(setup, AcceptanceSettings(seconds=15.0, ask=False))
    imu, wheels = recording.imu, recording.wheels
    assert wheels is not None
    turns = dict(zip(wheels.stamps.tolist(), wheels.angle.tolist(), strict=True))
    values = np.hstack([imu.gyro, imu.accel]).tolist()
    times = {*turns, *imu.stamps.tolist()}
    readings = dict(zip(imu.stamps.tolist(), values, strict=True))
    for index, stamp in enumerate(sorted(times)):
        if stamp in turns:
            acceptance.add_wheels(wheel_reading(stamp + 1, turns[stamp]))
        if stamp in readings:
            acceptance.add_imu(stamp + 1, tuple(readings[stamp]))
        if index % 50 == 0:
            acceptance.look(stamp * 1e-9)
    return acceptance


def test_a_robot_that_balances_is_watched_without_steps(drive: Simulated) -> None:
    acceptance = watched(drive.recording, drive.setup)
    assert acceptance.ended
    assert {*findings(acceptance)} <= {"gyro saturation", "accelerometer saturation"}


def test_a_contradiction_is_found_while_watching(drive: Simulated) -> None:
    wheels = drive.recording.wheels
    assert wheels is not None
    backward = replace(drive.recording, wheels=replace(wheels, angle=-wheels.angle))
    assert findings(watched(backward, drive.setup))["wheels sign"].value == [-1, -1]
