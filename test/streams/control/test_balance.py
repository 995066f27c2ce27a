"""When the motors run, when they are cut, and their commands."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from twbr_estimation.controllers import MotorVoltages
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.pipeline.pairing import WheelReading
from twbr_estimation.robot import Robot
from twbr_estimation.simulation.simulated_robot import SimulatedRobot
from twbr_estimation.streams.control.balance import (
    BalanceConfiguration,
    BalanceSettings,
    BalanceStream,
    Standing,
)

PERIOD = 5_000_000
OFF = MotorVoltages(0.0, 0.0)


def stream(robot: Robot | None = None, **settings: object) -> BalanceStream:
    return BalanceStream(
        BalanceConfiguration(BalanceSettings(**settings), robot=robot or Robot())  # type: ignore[arg-type]
    )


def fed(live: BalanceStream, now: int, tilt: float = 0.02, wheel: float = 0.0) -> MotorVoltages:
    live.add_tilt(now, tilt, 0.0)
    live.add_wheels(WheelReading(now, wheel, 0.0, 1.0))
    return live.step(now)


def balancing(**settings: object) -> tuple[BalanceStream, int]:
    """Return a stream that balances a slight lean, and the time of its last step."""
    live = stream(**settings)
    for k in range(1, 11):
        voltages = fed(live, k * PERIOD)
    assert live.standing is Standing.BALANCING
    assert voltages.left > 0.0
    return live, 10 * PERIOD


def test_nothing_runs_before_tilt_and_wheels():
    live = stream()
    assert live.step(PERIOD) == OFF
    live.add_tilt(2 * PERIOD, 0.1, 0.0)
    assert live.step(2 * PERIOD) == OFF
    assert live.standing is Standing.WAITING


def test_a_fall_cuts_and_standing_upright_for_a_while_starts_again():
    live, now = balancing(recovery_time=0.1)
    assert fed(live, now + PERIOD, tilt=0.7) == OFF
    assert live.standing is Standing.FALLEN
    assert fed(live, now + 2 * PERIOD, tilt=0.3) == OFF  # not fallen, not upright either
    upright = [fed(live, now + (3 + k) * PERIOD) != OFF for k in range(40)]
    assert upright.index(True) == pytest.approx(0.1 / 0.005, abs=2)


def test_a_short_moment_upright_is_not_enough():
    live, now = balancing(recovery_time=0.1)
    fed(live, now + PERIOD, tilt=0.7)
    for k in range(2, 200):
        tilt = 0.3 if k % 10 == 0 else 0.0
        assert fed(live, now + k * PERIOD, tilt=tilt) == OFF


def test_a_late_tilt_cuts_until_it_comes_again():
    live, now = balancing(tilt_timeout=0.05)
    for k in range(1, 30):
        live.add_wheels(WheelReading(now + k * PERIOD, 0.0, 0.0, 1.0))
        voltages = live.step(now + k * PERIOD)
        assert (voltages == OFF) == (k > 10), k
    assert live.standing is Standing.TILT_LATE
    assert fed(live, now + 30 * PERIOD) != OFF


def test_late_wheels_cut():
    live, now = balancing(wheel_timeout=0.1)
    for k in range(1, 30):
        live.add_tilt(now + k * PERIOD, 0.02, 0.0)
        voltages = live.step(now + k * PERIOD)
        assert (voltages == OFF) == (k > 20), k
    assert live.standing is Standing.WHEELS_LATE


def test_an_invalid_tilt_cuts_until_it_is_valid():
    live, now = balancing()
    live.set_valid(False)
    assert fed(live, now + PERIOD) == OFF
    assert live.standing is Standing.TILT_INVALID
    live.set_valid(True)
    assert fed(live, now + 2 * PERIOD) != OFF


def test_what_is_not_finite_counts_as_absent():
    live, now = balancing()
    for k in range(1, 15):
        live.add_tilt(now + k * PERIOD, math.nan, 0.0)
        live.command(now + k * PERIOD, math.inf, 0.0)
        live.add_wheels(WheelReading(now + k * PERIOD, 0.0, 0.0, 1.0))
        voltages = live.step(now + k * PERIOD)
        assert all(map(math.isfinite, voltages))
    assert live.standing is Standing.TILT_LATE


def test_time_set_back_starts_afresh():
    live, _ = balancing()
    live.reset()
    assert live.step(PERIOD) == OFF
    assert live.standing is Standing.WAITING
    assert fed(live, 2 * PERIOD) is not None
    assert live.standing is Standing.BALANCING


def test_the_encoders_turn_with_the_body_is_added_back():
    live = stream()
    for k in range(1, 200):  # the body leans, the wheels stay on the ground
        tilt = 0.001 * k
        live.add_tilt(k * PERIOD, tilt, 0.2)
        live.add_wheels(WheelReading(k * PERIOD, -tilt, 0.0, 1.0))
        live.step(k * PERIOD)
    assert live.odometry.position == pytest.approx(0.0, abs=1e-12)
    assert live.odometry.velocity == pytest.approx(0.0, abs=1e-12)


def test_wheels_that_come_seldom_still_give_the_speed():
    live = stream(replace(Robot(), encoder_placement="ground"))
    for k in range(1, 400):
        live.add_tilt(k * PERIOD, 0.0, 0.0)
        if k % 4 == 0:
            live.add_wheels(WheelReading(k * PERIOD, 2.0 * k * 0.005, 0.0, 1.0))
        live.step(k * PERIOD)
    assert live.odometry.velocity == pytest.approx(2.0 * 0.0375, rel=1e-3)


def test_commands_are_limited_ramped_and_forgotten():
    live, now = balancing(largest_velocity=0.4, largest_acceleration=1.0, command_timeout=0.5)
    targets = []
    for k in range(1, 400):
        if k < 150:
            live.command(now + k * PERIOD, 5.0, 0.0)
        fed(live, now + k * PERIOD)
        targets.append(live.target[0])
    steps = [abs(b - a) for a, b in pairwise(targets)]
    assert max(targets) == pytest.approx(0.4)
    assert max(steps) <= 1.0 * 0.005 + 1e-12
    assert targets[-1] == 0.0


def test_a_robot_without_heading_does_not_turn():
    live, now = balancing()
    live.command(now, 0.0, 2.0)
    left, right = fed(live, now + PERIOD)
    assert left == right


def test_another_controllers_parameters_are_checked_before_anything_changes():
    live, now = balancing()
    wrong = BalanceConfiguration(parameters={"pid": {"tilt_gain": -1.0}})
    with pytest.raises(ConfigurationError, match=r"pid\.tilt_gain"):
        live.configure(wrong)
    assert fed(live, now + PERIOD) != OFF


@pytest.mark.parametrize(
    "settings",
    [{"fall_tilt": 9.0}, {"controller": "none"}, {"recovery_tilt": 0.4, "fall_tilt": 0.3}],
)
def test_settings_out_of_bounds_are_refused(settings):
    with pytest.raises(ConfigurationError):
        stream(**settings)


def test_in_the_loop_a_fall_is_seen_and_over():
    robot = SimulatedRobot("paper", 5, 0.005, disturbed=False, command_delay=0.005)
    live = stream(robot.setup.robot)
    seen = []
    for k in range(1600):
        reading = robot.reading
        live.add_tilt(reading.stamp, reading.truth.tilt, reading.truth.rate)
        live.add_wheels(WheelReading(reading.stamp, reading.wheels[0], 0.0, 1.0))
        robot.advance(live.step(reading.stamp), 0.005)
        seen.append(live.standing)
        if k == 400:
            robot.push(80.0, 0.2)
    assert seen.count(Standing.FALLEN) > 20
    assert robot.falls == 1
    assert seen[-1] is Standing.BALANCING
    assert abs(robot.truth.tilt) < 0.05
