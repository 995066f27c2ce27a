"""The physics against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.physics.engine import Engine, empty
from twbr_estimation.physics.model import Surroundings
from twbr_estimation.physics.performance import performed
from twbr_estimation.physics.sensing import senses_of
from twbr_estimation.physics.state import (
    VELOCITY,
    WHEEL_RATES,
    moving,
    quaternion,
    rotations,
    tilts,
)
from twbr_estimation.plants.laddach2022 import Loads, PlantState, advance, linearised
from twbr_estimation.recording import FloatArray
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY
from twbr_estimation.simulation.spatial_sensing import attitudes
from twbr_estimation.simulation.worlds import IDEAL

pytest.importorskip("mujoco", reason="MuJoCo is not installed: extra `physics`")

STEP = 0.0005
FREE_ROBOT = Robot(torque_constant=1e-5, back_emf_constant=1e-5)
"""Its motors do nothing; the friction of its gears is taken away in `engine_of`."""


def engine_of(robot: Robot, monkeypatch: pytest.MonkeyPatch, tilt: float = 0.0) -> Engine:
    monkeypatch.setattr("twbr_estimation.physics.model.GEAR_FRICTION", 0.0)
    return Engine(robot, Surroundings(tilt=tilt), STEP)


def run(engine: Engine, seconds: float, voltage: float = 0.0) -> FloatArray:
    rows = empty(round(seconds / STEP) + 1)
    rows[0] = engine.row()
    engine.advance((voltage, voltage), rows[1:])
    return rows


def test_angles_and_attitudes_are_those_of_the_rig() -> None:
    for heading, roll, tilt in ((0.3, -0.2, 0.5), (-2.0, 0.4, 3.0), (1.0, 0.1, -1.8)):
        row = np.zeros(17)
        row[3:7] = quaternion(heading, roll, tilt)
        (expected,) = attitudes(*(np.array([each]) for each in (heading, roll, tilt)))
        np.testing.assert_allclose(rotations(row[None])[0], expected, atol=1e-12)
        now = moving(row.tolist())
        assert (now.tilt, now.roll, now.heading) == pytest.approx((tilt, roll, heading))


def test_it_falls_with_the_pole_of_the_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """On free wheels a small tilt grows with the only unstable pole of the planar model."""
    poles = np.linalg.eigvals(linearised(FREE_ROBOT.plant())[0])
    engine = engine_of(FREE_ROBOT, monkeypatch, tilt=1e-5)
    tilt, _ = tilts(run(engine, 0.5))
    time = np.arange(tilt.size) * STEP
    np.testing.assert_allclose(tilt, 1e-5 * np.cosh(poles.real.max() * time), rtol=0.005)


def test_with_motors_it_moves_as_the_planar_model(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot()
    engine = engine_of(robot, monkeypatch, tilt=0.02)
    rows = run(engine, 0.4, 2.0)
    state, rest = PlantState(0.0, 0.0, 0.02, 0.0), Loads(0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)
    for _ in range(800):
        state = advance(state, 2.0, rest, robot.plant(), STEP)
    tilt, rate = tilts(rows)
    assert tilt[-1] == pytest.approx(state.tilt, rel=0.01)
    assert rate[-1] == pytest.approx(state.rate, rel=0.01)
    assert rows[-1, 0] == pytest.approx(state.position, rel=0.01)


def test_a_hanging_body_swings_with_the_period_of_a_pendulum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Wheels so heavy that the axle stays: a physical pendulum, its energy conserved."""
    robot = replace(
        FREE_ROBOT, body_height=-0.01, body_mass=0.01, body_inertia=1e-5, body_inertia_roll=1e-5,
        body_inertia_yaw=1e-5, wheel_mass=100.0, gear_ratio=1.0,
        wheel_inertia=10.0, wheel_inertia_across=10.0,
    )  # fmt: skip
    engine = engine_of(robot, monkeypatch, tilt=0.05)
    tilt, rate = tilts(run(engine, 8.0))
    inertia = robot.body_inertia + robot.body_mass * robot.body_height**2
    frequency = math.sqrt(robot.body_mass * STANDARD_GRAVITY * 0.01 / inertia)
    crossings = np.flatnonzero(np.diff(np.sign(tilt)) > 0)
    period = float(np.mean(np.diff(crossings))) * STEP
    assert period == pytest.approx(2.0 * math.pi / frequency, rel=0.005)
    energy = 0.5 * inertia * rate**2 - robot.body_mass * STANDARD_GRAVITY * 0.01 * np.cos(tilt)
    swing = robot.body_mass * STANDARD_GRAVITY * 0.01 * (1.0 - math.cos(0.05))
    assert np.ptp(energy) < 0.03 * swing


def test_wheels_roll_without_slip_on_a_drive() -> None:
    """What the encoders count on the body is the way of the axle less the tilt."""
    robot = Robot(track_width=0.16)
    rows, _, _ = performed("drive", robot, 1, 0.001, 8000)
    tilt, rate = tilts(rows)
    assert np.abs(tilt).max() < 0.5
    attitude = rotations(rows)
    heading = np.arctan2(-attitude[:, 0, 1], attitude[:, 1, 1])
    speed = rows[:, 9] * np.cos(heading) + rows[:, 10] * np.sin(heading)
    rolled = robot.wheel_radius * (rows[:, WHEEL_RATES].mean(axis=1) + rate)
    assert np.sqrt(np.mean(speed**2)) > 0.2
    np.testing.assert_allclose(rolled, speed, atol=0.03)
    assert np.sum(rolled - speed) * 0.001 == pytest.approx(0.0, abs=0.005)
    turned = (rows[-1, 8] - rows[-1, 7]) * robot.wheel_radius / robot.track_width
    assert turned == pytest.approx(np.unwrap(heading)[-1], abs=0.03)


def test_motors_reach_the_speed_of_their_back_emf(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the hand, wheels free: w = u / (n k_e)."""
    robot = Robot()
    engine = engine_of(robot, monkeypatch)
    engine.grasp()
    x, y, z, *angles = engine.pose()
    up = (x, y, z + 0.1, *angles)
    rows = empty(2000)
    engine.advance((3.0, 3.0), rows, up)
    speed = 3.0 / (robot.gear_ratio * robot.back_emf_constant)
    assert rows[-1, 15] == pytest.approx(speed, rel=0.001)


def test_the_imu_at_rest_reads_gravity_in_its_own_axes(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(mounting=(0.1, -0.2, 0.3), track_width=0.16)
    engine = engine_of(robot, monkeypatch)
    engine.grasp()
    rows = empty(4001)
    engine.advance((0.0, 0.0), rows, engine.pose())
    imu_input = senses_of(robot, IDEAL, 1).imu_input(rows[-2:], STEP)
    up = rotations(rows[-1:])[0][2] @ robot.rotation()
    np.testing.assert_allclose(imu_input.force[0], STANDARD_GRAVITY * up, atol=1e-3)
    np.testing.assert_allclose(imu_input.rate[0], 0.0, atol=1e-4)


def test_in_free_fall_the_imu_reads_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(track_width=0.16)
    engine = engine_of(robot, monkeypatch)
    engine.place((0.0, 0.0, 1.0, 0.0, 0.0, 0.3))
    rows = run(engine, 0.3)
    imu_input = senses_of(robot, IDEAL, 1).imu_input(rows, STEP)
    assert np.abs(imu_input.force).max() < 1e-6
    drop = 0.5 * STANDARD_GRAVITY * 0.3**2
    assert 1.0 - rows[-1, 2] == pytest.approx(drop, rel=0.005)


def test_the_force_is_that_of_the_engines_own_accelerometer() -> None:
    """A spinning, driving robot: the lever arm off all axes, against MuJoCo's sensors."""
    import mujoco

    from twbr_estimation.physics.model import description

    robot = Robot(lever_arm=(0.02, -0.03, 0.1), track_width=0.16)
    site = '<site name="imu" pos="0.02 -0.03 0.1"/></body>\n  </worldbody>'
    sensors = '<sensor><accelerometer site="imu"/><gyro site="imu"/></sensor></mujoco>'
    text = description(robot, Surroundings(), STEP).replace("</mujoco>", sensors)
    head, tail = text.rsplit("</body>", 1)
    model = mujoco.MjModel.from_xml_string(f"{head}{site}{tail.split('</worldbody>')[1]}")
    data = mujoco.MjData(model)
    data.qvel[:] = 0.3, 0.1, 0.0, 0.2, -0.4, 3.0, 8.0, 8.0
    data.qpos[2] = 1.0  # in the air, where nothing jumps
    rows, imu_input = [], []
    for _ in range(200):
        mujoco.mj_step(model, data)
        rows.append(np.concatenate([data.qpos, data.qvel]))
        imu_input.append(data.sensordata.copy())
    mine = senses_of(robot, IDEAL, 1).imu_input(np.array(rows), STEP)
    theirs, settled = np.array(imu_input), 30  # until then the motors brake within a few steps
    np.testing.assert_allclose(mine.force[settled:], theirs[1 + settled :, :3], atol=0.02)
    np.testing.assert_allclose(mine.rate[:-1], theirs[2:, 3:], atol=1e-9)


def test_speed_of_the_axle_is_its_velocity_along_the_heading(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    engine = engine_of(Robot(), monkeypatch)
    rows = run(engine, 0.3, 2.0)
    now = moving(rows[-1].tolist())
    assert now.velocity == pytest.approx(float(np.hypot(*rows[-1, VELOCITY][:2])), rel=1e-6)
