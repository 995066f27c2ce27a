from __future__ import annotations

import math

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.simulation.simulated_robot import SimulatedRobot
from twbr_estimation.streams.simulator.settings import (
    CommandUnit,
    Disturbance,
    SensorPath,
    SimulatorSettings,
)
from twbr_estimation.streams.simulator.simulator import LARGEST_LAG, Simulator

PERIOD = 2_500_000
"""Of the IMU [ns]."""


def simulator(**changes: object) -> Simulator:
    given: dict[str, object] = {"world": "ideal", "duration": 2.0, "held": False, **changes}
    return Simulator(SimulatorSettings(**given))  # type: ignore[arg-type]


def test_it_is_the_simulated_robot() -> None:
    made, robot = (
        simulator(world="paper"),
        SimulatedRobot("paper", 1, 0.0025, duration=2.0, disturbed=False, stay_down=True),
    )
    robot.place(0.0)
    for voltage in (1.0, -2.0, 3.0):
        made.command([voltage])
        found = [each for _ in range(4) for each in made.advance(1)]
        assert found == robot.advance((voltage, voltage), 0.01)


def test_real_time_gives_each_reading_once_under_its_stamp() -> None:
    made = simulator()
    made.begin_at(10**18)
    stamps = [
        r.stamp
        for now in (1, PERIOD, PERIOD + 5, 6 * PERIOD)
        for r in made.advance_to(10**18 + now)
    ]
    assert stamps == [10**18 + k * PERIOD for k in range(1, 7)]


def test_a_stalled_process_leaves_time_out() -> None:
    made = simulator()
    made.begin_at(0)
    found = made.advance_to(10**9)
    assert found[-1].stamp == 10**9
    assert len(found) == LARGEST_LAG / 0.0025
    assert made.counts["late"] == 1


@pytest.mark.parametrize("bad", [[], [1.0, 2.0, 3.0], [math.nan], [0.0, math.inf]])
def test_a_bad_command_is_counted_and_changes_nothing(bad: list[float]) -> None:
    made, other = simulator(), simulator()
    for each in (made, other):
        assert each.command([2.0, 2.0])
    assert not made.command(bad)
    assert made.counts["rejected"] == 1 and "finite" in made.rejection
    assert made.advance(5) == other.advance(5)


def test_without_commands_the_motors_are_cut() -> None:
    made = simulator(command_timeout=0.05)
    made.command([5.0])
    made.advance(20)
    assert not made.cut
    made.advance(2)
    assert made.cut and made.counts["timeouts"] == 1
    made.command([5.0])
    assert not made.cut


def test_a_torque_of_a_wheel_is_the_effort_of_its_joint() -> None:
    made = simulator(command_unit=CommandUnit.TORQUE, wheel_joints=("left", "right"))
    for _ in range(10):
        made.command([0.05, 0.05])
        (reading,) = made.advance(1)
    assert made.joints == ("left", "right")
    assert made.wheels(reading).effort == pytest.approx((0.05, 0.05))
    assert reading.truth.velocity > 0.001


def test_the_velocity_of_a_wheel_is_that_of_its_angle() -> None:
    made = simulator()
    made.command([3.0])
    for _ in range(12):
        (reading,) = made.advance(1)
        wheels = made.wheels(reading)
    expected = (reading.truth.velocity / 0.0375) - reading.truth.rate
    assert made.joints == ("wheel_joint",)
    assert wheels.velocity[0] == pytest.approx(expected, rel=0.3)
    assert wheels.position == reading.wheels


def test_two_encoders_have_the_names_of_the_wheels() -> None:
    made = simulator(world="W4")
    assert made.joints == ("left_wheel_joint", "right_wheel_joint")
    assert len(made.wheels(made.latest).position) == 2


def test_a_hand_holds_the_robot_until_it_is_commanded() -> None:
    made = simulator(world="paper", held=True, start_tilt=0.1)
    made.command([0.0, 0.0])
    made.advance(200)
    assert made.held and abs(made.latest.truth.tilt - 0.1) < 0.001
    made.command([1e-9])
    made.advance(100)
    assert not made.held and made.latest.truth.tilt > 0.2


def test_disturbances_on_demand() -> None:
    made, pushed = simulator(), simulator()
    pushed.push(Disturbance(push_force=2.0, push_duration=0.0504))
    made.advance(40)
    pushed.advance(40)
    assert pushed.latest.truth.tilt > made.latest.truth.tilt + 0.001
    slipped = simulator()
    slipped.slip(Disturbance(slip_speed=0.5))
    slipped.advance(40)
    assert slipped.latest.wheels[0] - made.latest.wheels[0] > 0.5


def test_reset_begins_again_and_stamps_go_on() -> None:
    made = simulator(world="paper")
    made.begin_at(5 * 10**9)
    first = [reading.imu for reading in made.advance(20)]
    made.command([4.0])
    made.advance(100)
    before = made.stamp
    made.reset()
    again = made.advance(20)
    assert [reading.imu for reading in again] == first
    assert again[0].stamp == before + PERIOD


def test_sensors_with_a_clock_of_their_own_report_the_past() -> None:
    made = simulator(world="paper")
    made.begin_at(10**9)
    readings = made.advance(10)
    assert made.at(readings[3].stamp * 1e-9 + 1e-6) == readings[3]
    assert made.imu_motion(readings[9].stamp * 1e-9 + 1.0)[:6] == readings[9].imu
    assert made.wheel_angle(1, readings[5].stamp * 1e-9 + 1e-6) == readings[5].wheels[0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"world": "mars"}, "there is no world 'mars'"),
        ({"imu_period": 0.0007}, "imu_period: 0.0007 s is not a multiple"),
        ({"wheel_joints": ("a", "b", "c")}, "wheel_joints: 3 joints"),
        ({"lockstep": True, "sensors": SensorPath.REGISTERS}, "cannot be read in lockstep"),
        ({"lockstep": True, "imu_period": 0.002}, "control_period: 0.005 s is not a multiple"),
        ({"seed": -1}, "seed"),
    ],
)
def test_what_cannot_be_simulated_says_why(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        simulator(**changes)
