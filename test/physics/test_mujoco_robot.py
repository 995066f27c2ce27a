"""The robot in MuJoCo that is commanded from outside, alone and in the loops."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.cli.main import main
from twbr_estimation.closed_loop.trial import TRUTH, Trial, run
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.physics.engine import BAR_HEIGHT, empty
from twbr_estimation.physics.mujoco_robot import PhysicsRobot
from twbr_estimation.physics.performance import Performance
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.streams.simulator.settings import Disturbance, Physics, SimulatorSettings
from twbr_estimation.streams.simulator.simulator import Simulator

pytest.importorskip("mujoco", reason="MuJoCo is not installed: extra `physics`")


def test_a_commanded_robot_reads_what_it_does() -> None:
    """Left lying with motors off: it falls as upright bodies do, then its IMU reads gravity."""
    robot = PhysicsRobot("stand", "ideal", 1, 0.002, stay_down=True)
    robot.place(0.1)
    readings = robot.advance((0.0, 0.0), 3.0)
    assert len(readings) == 1500 and readings[-1].stamp == robot.stamp
    assert robot.held and robot.falls == 1
    assert abs(readings[-1].truth.tilt) > 1.3
    gyro = np.array([reading.imu[1] for reading in readings])
    rate = np.array([reading.truth.rate for reading in readings])
    np.testing.assert_allclose(gyro, rate, atol=1e-6)
    assert math.hypot(*readings[-1].imu[3:]) == pytest.approx(STANDARD_GRAVITY, rel=1e-3)
    early = readings[100]  # still on its wheels, which roll: the body's turn is in the encoders
    rolled = early.truth.position / robot.setup.robot.wheel_radius - early.truth.tilt
    assert early.wheels[0] - readings[0].wheels[0] == pytest.approx(rolled + 0.1, abs=0.01)


def test_commands_may_come_in_any_pieces() -> None:
    whole, parts = (PhysicsRobot("lifted", "paper", 3, 0.0025) for _ in range(2))
    found = whole.advance((0.4, 0.2), 0.1)
    assert [r for _ in range(20) for r in parts.advance((0.4, 0.2), 0.005)] == found
    other = PhysicsRobot("lifted", "paper", 4, 0.0025)
    assert other.advance((0.4, 0.2), 0.1) != found


def test_pushes_bars_and_slippery_ground_on_demand() -> None:
    pushed, still, slipped, tripped = (PhysicsRobot("stand", "ideal", 1, 0.005) for _ in range(4))
    pushed.push(3.0, 0.2)
    slipped.slip(0.3, 0.2)
    for robot in (still, pushed):
        robot.advance((0.0, 0.0), 0.2)
    assert pushed.truth.tilt > still.truth.tilt + 0.01
    for robot in (slipped, tripped):
        robot.advance((3.0, 3.0), 0.1)
    assert 0.0 < slipped.truth.position < 0.3 * tripped.truth.position


def test_a_bar_on_demand_lifts_a_robot_that_drives_over_it() -> None:
    highest = []
    for laid in (False, True):
        performance = Performance("stand", Robot(track_width=0.16), 1, 0.001)
        performance.script = performance.stage.balanced(2.0, 0.4)
        if laid:
            performance.engine.lay_bar(1.0)
        rows = empty(1500)
        for i in range(300):
            performance.advance(rows[5 * i : 5 * i + 5])
        highest.append(rows[:, 2].max())
    assert highest[1] - highest[0] == pytest.approx(BAR_HEIGHT, rel=0.4)


@pytest.mark.parametrize(
    ("voltages", "duration", "message"),
    [
        ((1.0, math.nan), 0.01, "not two finite voltages"),
        ((1.0, 1.0), 0.0007, r"duration: 0\.0007 s is not a multiple"),
    ],
)
def test_what_cannot_be_simulated(
    voltages: tuple[float, float], duration: float, message: str
) -> None:
    with pytest.raises(ConfigurationError, match=message):
        PhysicsRobot("stand", "ideal", 1).advance(voltages, duration)


@pytest.mark.parametrize("scene", ["drive", "lifted"])
def test_the_controller_of_the_project_balances_it(scene: str) -> None:
    outcome = run(Trial("ideal", TRUTH, "pid", 1, 5.5, scene=scene))
    assert outcome.falls == 0
    assert (outcome.upright < 1.0) is (scene == "lifted")  # a hand holds it
    if scene == "drive":
        assert outcome.rms_position > 0.1  # the scene's commands are followed


def test_the_command_balances_in_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    once = ["balance", "--seeds", "1", "--duration", "2", "--jobs", "1", "--estimator", "truth"]
    physics = ["--physics", "mujoco", "--scene", "stand"]
    assert main([*once, *physics, "--json", "-"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["runs"]
    assert found["scene"] == "stand" and found["falls"] == 0
    assert main([*once, "--scene", "stand"]) == 1
    assert "needs --physics mujoco" in capsys.readouterr().err
    assert main([*once, "--physics", "mujoco", "--scene", "poses"]) == 1
    assert "there is no scene 'poses'" in capsys.readouterr().err


def test_the_simulator_of_the_node_takes_it() -> None:
    settings = SimulatorSettings(physics=Physics.MUJOCO, world="ideal", held=True, start_tilt=0.1)
    made = Simulator(settings)
    assert made.joints == ("left_wheel_joint", "right_wheel_joint")
    made.command([0.0, 0.0])
    made.advance(100)
    assert made.held and abs(made.latest.truth.tilt - 0.1) < 0.001
    made.command([1e-9])
    made.push(Disturbance(push_force=3.0))
    made.advance(200)
    assert not made.held and made.latest.truth.tilt > 0.5
    made.reset()
    first = [reading.imu for reading in made.advance(20)]
    again = Simulator(settings)
    assert [reading.imu for reading in again.advance(20)] == first
    with pytest.raises(ConfigurationError, match="there is no scene 'mars'"):
        Simulator(replace(settings, scene="mars"))
