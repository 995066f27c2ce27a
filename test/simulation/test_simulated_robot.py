from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.rig import STOP_TILT
from twbr_estimation.simulation.rig_controller import balance_gains, balance_voltage
from twbr_estimation.simulation.simulated_robot import SensorReading, SimulatedRobot
from twbr_estimation.simulation.worlds import world_named

NO_COMMAND = (0.0, 0.0)


def driven(world: str, seed: int, dt: float, duration: float, *, compiled: bool):
    """Return the robot under the rig's own controller, and its readings."""
    period = world_named(world).control_period
    robot = SimulatedRobot(world, seed, dt, command_delay=period, compiled=compiled)
    gains, pending = balance_gains(robot.plant, period), 0.0
    readings = [robot.reading]
    for _ in range(round(duration / period)):
        pending = 0.0 if robot.held else balance_voltage(
            robot.truth, *robot.commanded_target, pending, gains, robot.plant.supply_voltage
        )  # fmt: skip
        readings += robot.advance((pending, pending), period)
    return robot, readings


def columns(readings: list[SensorReading]) -> dict[str, np.ndarray]:
    return {
        "tilt": np.array([reading.truth.tilt for reading in readings]),
        "reference": np.array([reading.reference for reading in readings]),
        "gyro": np.array([reading.imu[:3] for reading in readings]),
        "accel": np.array([reading.imu[3:] for reading in readings]),
        "wheels": np.array([reading.wheels for reading in readings]),
    }


@pytest.mark.parametrize("world", ["ideal", "paper", "W2"])
def test_the_rigs_own_commands_make_the_very_recording(world):
    simulated = simulate(world, 0.002, 20.0, 41)
    robot, readings = driven(world, 41, 0.002, 20.0, compiled=True)
    recording, stepped = simulated.recording, columns(readings[:-1])
    np.testing.assert_array_equal(stepped["tilt"], recording.truth.tilt)
    np.testing.assert_array_equal(stepped["reference"], recording.reference.tilt)
    np.testing.assert_array_equal(stepped["gyro"], recording.imu.gyro)
    np.testing.assert_array_equal(stepped["accel"], recording.imu.accel)
    np.testing.assert_array_equal(stepped["wheels"], recording.wheels.angle)
    np.testing.assert_array_equal(
        [reading.stamp for reading in readings[:-1]], recording.imu.stamps
    )
    assert robot.falls == simulated.falls


def test_in_three_dimensions_too():
    simulated = simulate("W4", 0.002, 10.0, 41)
    recording = simulated.recording
    _, readings = driven("W4", 41, 0.002, 10.0, compiled=True)
    stepped = columns(readings[:-1])
    np.testing.assert_array_equal(stepped["tilt"], recording.truth.tilt)
    for name, expected in (("gyro", recording.imu.gyro), ("accel", recording.imu.accel)):
        # The heading is counted from elsewhere: rounding may tip a count.
        counts = np.abs(stepped[name] - expected) / (2.0**-15 * np.max(np.abs(expected)))
        assert np.mean(counts > 1e-6) < 1e-4
    np.testing.assert_allclose(stepped["wheels"], recording.wheels.angle, atol=1e-9)


@pytest.mark.parametrize("world", ["paper", "W4"])
def test_interpreted_and_compiled_steps_agree(world):
    (_, interpreted), (_, compiled) = (
        driven(world, 5, 0.005, 2.0, compiled=choice) for choice in (False, True)
    )
    left, right = columns(interpreted), columns(compiled)
    np.testing.assert_allclose(left["tilt"], right["tilt"], atol=1e-7)
    np.testing.assert_allclose(left["accel"], right["accel"], atol=2e-3)


def test_the_seed_decides_everything():
    runs = [columns(driven("W2", seed, 0.005, 1.0, compiled=False)[1]) for seed in (7, 7, 8)]
    np.testing.assert_array_equal(runs[0]["accel"], runs[1]["accel"])
    assert not np.array_equal(runs[0]["accel"], runs[2]["accel"])


def test_how_time_is_cut_changes_nothing():
    whole, parts = (SimulatedRobot("paper", 3, 0.005) for _ in range(2))
    expected = whole.advance((1.0, 1.0), 0.1)
    got = [reading for _ in range(200) for reading in parts.advance((1.0, 1.0), 0.0005)]
    assert [reading.stamp for reading in got] == [reading.stamp for reading in expected]
    assert got == expected


def test_a_command_waits_for_its_delay():
    prompt = SimulatedRobot("ideal", 3, disturbed=False)
    late = SimulatedRobot("ideal", 3, disturbed=False, command_delay=0.004)
    late.advance((2.0, 2.0), 0.004)
    assert late.truth.velocity == 0.0
    late.advance((2.0, 2.0), 0.004)
    prompt.advance((2.0, 2.0), 0.004)
    assert late.truth.velocity == pytest.approx(prompt.truth.velocity)
    assert late.truth.velocity > 0.01


def test_a_push_pushes_and_nothing_else_does():
    robot = SimulatedRobot("ideal", 3, disturbed=False)
    robot.advance(NO_COMMAND, 0.5)
    assert abs(robot.truth.tilt) < 1e-6
    robot.push(2.0, 0.1)
    robot.advance(NO_COMMAND, 0.1)
    assert robot.truth.tilt > 0.005
    assert robot.truth.velocity > 0.0


def test_a_slip_turns_the_wheels_but_not_the_robot():
    robot = SimulatedRobot("ideal", 3, disturbed=False)
    robot.slip(0.3, 0.1)
    robot.advance(NO_COMMAND, 0.1)
    assert robot.truth.position == pytest.approx(0.0, abs=1e-6)
    slipped = 0.3 * 0.1 * 2.0 / math.pi
    assert robot.reading.wheels[0] * 0.0375 == pytest.approx(slipped, rel=1e-3)


def test_an_obstacle_stops_the_wheels():
    robot = SimulatedRobot("ideal", 3, disturbed=False)
    robot.advance((6.0, 6.0), 0.1)
    speed = robot.truth.velocity
    assert speed > 0.3
    robot.obstacle()
    robot.advance((6.0, 6.0), 0.0005)
    assert robot.truth.velocity == pytest.approx(-0.4 * speed, rel=0.2)


def test_a_fallen_robot_is_stood_up_or_stays():
    helped, left = (SimulatedRobot("paper", 3, stay_down=stay) for stay in (False, True))
    for robot in (helped, left):
        robot.place(0.3)
        robot.advance(NO_COMMAND, 3.0)
        assert robot.falls >= 1
    assert abs(left.truth.tilt) > 0.5
    assert left.held and left.falls == 1
    left.place(0.0)
    assert not left.held and left.truth.tilt == 0.0


def test_after_the_drawn_time_it_goes_on_without_a_jolt():
    robot = SimulatedRobot("W4", 3, 0.002, duration=2.0)
    forces, times = [], []
    while robot.time < 4.0:  # two seconds drawn, one to close, and on into the next round
        for reading in robot.advance(NO_COMMAND, 0.002):
            forces.append(reading.imu[4])
            times.append(robot.time)
    near = [abs(force) for force, time in zip(forces, times, strict=True) if 2.9 < time < 3.1]
    assert len(near) > 90
    assert max(near) < 1.0  # a jump of the roll would make it 10 m/s^2


@pytest.mark.parametrize("command", [(math.nan, 0.0), (1.0,), (0.0, math.inf)])
def test_what_is_no_command_is_refused(command):
    with pytest.raises(ConfigurationError, match="voltages"):
        SimulatedRobot("ideal", 3).advance(command, 0.005)


@pytest.mark.parametrize("period", [0.0, -0.005, 0.0007, math.nan])
def test_what_is_no_period_is_refused(period):
    with pytest.raises(ConfigurationError, match="multiple"):
        SimulatedRobot("ideal", 3, period)


def test_interpreted_steps_import_no_compiler():
    program = (
        "import sys; from twbr_estimation.simulation.simulated_robot import SimulatedRobot;"
        "SimulatedRobot('paper', 3, duration=1.0).advance((0.0, 0.0), 0.1);"
        "print('numba' in sys.modules)"
    )
    result = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    assert result.stdout.strip() == "False"


def test_a_robot_that_lies_does_not_sink_into_the_ground():
    robot = SimulatedRobot("ideal", 3, 0.05, duration=5.0, disturbed=False, stay_down=True)
    robot.place(0.3)
    robot.advance(NO_COMMAND, 5.0)
    assert robot.held
    assert robot.truth.tilt == pytest.approx(STOP_TILT, abs=0.01)
    robot.advance(NO_COMMAND, 20.0)
    assert robot.truth.tilt == pytest.approx(STOP_TILT, abs=0.01)
