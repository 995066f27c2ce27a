"""What every controller promises."""

from __future__ import annotations

import math

import pytest

from twbr_estimation.controllers import ControlInput, controller_named, controllers
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.robot import Robot
from twbr_estimation.simulation.simulated_robot import SimulatedRobot

NAMES = tuple(controllers())
PERIOD = 0.005
AT_REST = ControlInput(PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def prepared(name: str):
    entry = controller_named(name)
    return entry, entry.derive(entry.configure(), Robot(), PERIOD)


def true_input(robot: SimulatedRobot, velocity: float = 0.0) -> ControlInput:
    return ControlInput(PERIOD, *robot.truth, velocity, 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_at_rest_it_does_nothing(name):
    entry, coefficients = prepared(name)
    state = entry.reset(AT_REST, coefficients)
    for _ in range(10):
        state = entry.step(state, AT_REST, coefficients)
    assert state.left == pytest.approx(0.0, abs=1e-9) == state.right


@pytest.mark.parametrize("name", NAMES)
def test_it_drives_under_a_lean_and_no_harder_than_the_supply(name):
    entry, coefficients = prepared(name)
    for tilt in (-2.0, -0.05, 0.05, 2.0):
        leaning = AT_REST._replace(tilt=tilt, rate=tilt)
        state = entry.step(entry.reset(AT_REST, coefficients), leaning, coefficients)
        for voltage in (state.left, state.right):
            assert math.copysign(1.0, voltage) == math.copysign(1.0, tilt)
            assert abs(voltage) <= 12.0


@pytest.mark.parametrize("name", NAMES)
def test_it_turns_to_the_left_with_the_right_wheel(name):
    entry, coefficients = prepared(name)
    turning = AT_REST._replace(target_yaw_rate=1.0)
    state = entry.step(entry.reset(AT_REST, coefficients), turning, coefficients)
    assert state.right > 0.0 > state.left
    assert state.left == pytest.approx(-state.right)


@pytest.mark.parametrize("name", NAMES)
def test_a_parameter_out_of_its_bounds_is_refused(name):
    entry = controller_named(name)
    first = entry.declared()[0]
    with pytest.raises(ConfigurationError, match=f"{name}.{first.name}"):
        entry.configure({first.name: first.bounds.maximum + 1.0})
    with pytest.raises(ConfigurationError, match="no_such"):
        entry.configure({"no_such": 1.0})


@pytest.mark.parametrize("world", ["ideal", "paper"])
@pytest.mark.parametrize("name", NAMES)
def test_it_balances_on_the_true_tilt(name, world):
    entry, coefficients = prepared(name)
    robot = SimulatedRobot(world, 6, PERIOD, disturbed=False, command_delay=PERIOD)
    robot.place(0.1)
    state = entry.reset(true_input(robot), coefficients)
    positions = []
    for _ in range(2000):
        state = entry.step(state, true_input(robot), coefficients)
        robot.advance((state.left, state.right), PERIOD)
        positions.append(robot.truth.position)
    assert robot.falls == 0
    assert abs(robot.truth.tilt) < 0.02
    assert max(positions[-200:]) - min(positions[-200:]) < 0.05


@pytest.mark.parametrize("name", NAMES)
def test_it_follows_a_commanded_speed(name):
    entry, coefficients = prepared(name)
    robot = SimulatedRobot("ideal", 6, PERIOD, disturbed=False, command_delay=PERIOD)
    state = entry.reset(true_input(robot), coefficients)
    for _ in range(2000):
        state = entry.step(state, true_input(robot, 0.2), coefficients)
        robot.advance((state.left, state.right), PERIOD)
    assert robot.falls == 0
    assert robot.truth.velocity == pytest.approx(0.2, abs=0.02)


def test_an_unknown_name_lists_those_there_are():
    with pytest.raises(ConfigurationError, match="pid"):
        controller_named("none")
