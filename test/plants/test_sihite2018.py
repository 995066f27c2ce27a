"""Sihite 2018: the equations of motion against sympy, the coefficients against print."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from sympy.physics import mechanics

from twbr_estimation.plants.laddach2022 import Loads, PlantState
from twbr_estimation.plants.laddach2022 import accelerations as planar
from twbr_estimation.plants.sihite2018 import (
    EDUMIP,
    Commands,
    Linear,
    SpatialParameters,
    SpatialState,
    accelerations,
    angular_rate,
    linearised,
    linearised_as_printed,
    linearised_by_27,
    spatial_parameters,
    specific_force,
)
from twbr_estimation.robot import Robot

DT = 0.005


def kane():
    """Return sympy's equations: all coordinates, and rolling wheels as velocity constraints."""
    names = "x y psi theta right left"
    q = mechanics.dynamicsymbols(names)
    u = mechanics.dynamicsymbols(" ".join(f"u_{name}" for name in names.split()))
    torques = sympy.symbols("torque_right torque_left push")
    p = dict(zip(SpatialParameters._fields, sympy.symbols(SpatialParameters._fields), strict=True))
    ground, origin = mechanics.ReferenceFrame("N"), mechanics.Point("O")
    origin.set_vel(ground, 0)
    facing = ground.orientnew("A", "Axis", [q[2], ground.z])
    frame = facing.orientnew("B", "Axis", [q[3], facing.y])
    facing.set_ang_vel(ground, u[2] * ground.z)
    frame.set_ang_vel(ground, u[2] * facing.z + u[3] * facing.y)
    axle = mechanics.Point("P")
    axle.set_vel(ground, u[0] * ground.x + u[1] * ground.y)
    centre = axle.locatenew("C", p["body_height"] * frame.z)
    centre.set_vel(ground, axle.vel(ground) + frame.ang_vel_in(ground).cross(centre.pos_from(axle)))
    inertias = (p["body_inertia_roll"], p["body_inertia"], p["body_inertia_yaw"])
    body = mechanics.RigidBody(
        "body", centre, frame, p["body_mass"], (mechanics.inertia(frame, *inertias), centre)
    )
    bodies, constraints = [body], []
    loads = [(centre, -p["body_mass"] * p["gravity"] * ground.z + torques[2] * facing.x)]
    reaction = 0
    for side, turn, sign, torque in ((4, u[4], -1, torques[0]), (5, u[5], 1, torques[1])):
        wheel = frame.orientnew(f"W{side}", "Axis", [q[side], frame.y])
        wheel.set_ang_vel(ground, frame.ang_vel_in(ground) + turn * frame.y)
        hub = axle.locatenew(f"H{side}", sign * p["track_width"] / 2 * facing.y)
        hub.set_vel(ground, axle.vel(ground) + facing.ang_vel_in(ground).cross(hub.pos_from(axle)))
        across, along = p["wheel_inertia_across"], p["wheel_inertia"]
        inertia = mechanics.inertia(frame, across, along, across)  # round: any frame on the axle
        bodies.append(mechanics.RigidBody(f"w{side}", hub, wheel, p["wheel_mass"], (inertia, hub)))
        loads.append((wheel, torque * frame.y))
        reaction += torque
        contact = hub.vel(ground) + wheel.ang_vel_in(ground).cross(-p["wheel_radius"] * ground.z)
        constraints.append(contact.dot(facing.x))
    constraints.append(axle.vel(ground).dot(facing.y))
    loads.append((frame, -reaction * frame.y))
    method = mechanics.KanesMethod(
        ground,
        q,
        [u[2], u[3], u[4]],
        [coordinate.diff() - speed for coordinate, speed in zip(q, u, strict=True)],
        u_dependent=[u[0], u[1], u[5]],
        velocity_constraints=constraints,
    )
    method.kanes_equations(bodies, loads)
    speeds = [u[2], u[3], u[4], u[0], u[1], u[5]]
    known = [*q, *u, *torques, *p.values()]
    return sympy.lambdify(known, (method.mass_matrix, method.forcing), cse=True), speeds


def random_case(random: np.random.Generator) -> tuple[SpatialState, Commands, SpatialParameters]:
    parameters = SpatialParameters(*(np.array(EDUMIP) * random.uniform(0.5, 2.0, 13)).tolist())
    scales = np.array([1.0, 3.0, 3.0, 5.0, 20.0, 10.0])
    state = SpatialState(*(scales * random.uniform(-1.0, 1.0, 6)).tolist())
    return state, Commands(*random.uniform(-1.0, 1.0, 3).tolist()), parameters


def test_kanes_method_gives_the_same_accelerations() -> None:
    equations, _ = kane()
    random = np.random.default_rng(1)
    for _ in range(50):
        state, commands, p = random_case(random)
        lever = 0.5 * p.track_width / p.wheel_radius
        right = state.wheel_rate + lever * state.yaw_rate
        left = state.wheel_rate - lever * state.yaw_rate
        torques = [
            p.torque_gain * (commands.forward + sign * commands.turn) - p.torque_damping * rate
            for sign, rate in ((1.0, right), (-1.0, left))
        ]
        speed = p.wheel_radius * (state.wheel_rate + state.tilt_rate)
        ahead = [speed * np.cos(state.heading), speed * np.sin(state.heading)]
        q = [0.0, 0.0, state.heading, state.tilt, 0.3, -0.2]
        u = [*ahead, state.yaw_rate, state.tilt_rate, right, left]
        mass, forcing = equations(*q, *u, *torques, commands.push, *p)
        yaw, tilt, right_wheel, _, _, left_wheel = np.linalg.solve(mass, forcing)[:, 0]
        expected = [tilt, 0.5 * (right_wheel + left_wheel), yaw]
        np.testing.assert_allclose(accelerations(state, commands, p), expected, rtol=1e-9)


def test_the_linear_model_is_the_tangent() -> None:
    random = np.random.default_rng(2)
    for _ in range(20):
        state, commands, p = random_case(random)
        small = state._replace(tilt=1e-6 * state.tilt, tilt_rate=0.0, wheel_rate=1e-6)
        commands = Commands(1e-6 * commands.forward, commands.turn)
        linear, spin = linearised(p), small.tilt * small.yaw_rate**2
        tilt = linear.tilt_per_tilt * small.tilt + linear.tilt_per_wheel_rate * small.wheel_rate
        tilt += linear.tilt_per_command * commands.forward + linear.tilt_per_spin * spin
        wheel = linear.wheel_per_tilt * small.tilt + linear.wheel_per_spin * spin
        wheel += linear.wheel_per_wheel_rate * small.wheel_rate
        wheel += linear.wheel_per_command * commands.forward
        yaw = linear.yaw_per_yaw_rate * small.yaw_rate + linear.yaw_per_command * commands.turn
        found = accelerations(small, commands, p)
        np.testing.assert_allclose(found, [tilt, wheel, yaw], rtol=1e-5)


def test_without_yaw_it_is_laddachs_plant() -> None:
    robot = Robot(track_width=0.16)
    p, plant = spatial_parameters(robot), robot.plant()
    random = np.random.default_rng(3)
    for tilt, rate, wheel_rate, voltage, push in random.uniform(-1.0, 1.0, (20, 5)).tolist():
        state = SpatialState(tilt, 0.0, 0.0, rate, wheel_rate, 0.0)
        found = accelerations(state, Commands(voltage, 0.0, push), p)
        velocity = p.wheel_radius * (rate + wheel_rate)
        loads = Loads(0.0, push, p.body_height, 0.0, p.gravity)
        linear, angular = planar(PlantState(0.0, velocity, tilt, rate), voltage, loads, plant)
        assert found[0] == pytest.approx(angular, rel=1e-9, abs=1e-9)
        assert p.wheel_radius * (found[0] + found[1]) == pytest.approx(linear, rel=1e-9, abs=1e-9)
        assert found[2] == 0.0


def test_what_an_imu_measures_is_the_motion_of_its_place() -> None:
    """Differentiate the sensor's position twice along a path, and its attitude once."""
    lever, p = (0.02, -0.03, 0.05), EDUMIP
    tilt, heading, travel = (
        np.polynomial.Polynomial(c) for c in ([0.1, 0.5, -2.0], [0.3, 4.0, 1.0], [0.2, 1.5, 3.0])
    )

    def rotation(t: float) -> np.ndarray:
        (cp, sp), (ch, sh) = ((np.cos(a), np.sin(a)) for a in (tilt(t), heading(t)))
        pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        return np.array([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1]]) @ pitch

    def velocity(t: float) -> np.ndarray:
        step = 1e-5
        speed = travel.deriv()(t)
        rolling = speed * np.array([np.cos(heading(t)), np.sin(heading(t)), 0.0])
        return rolling + (rotation(t + step) - rotation(t - step)) @ lever / (2 * step)

    state = SpatialState(
        tilt(0),
        0.0,
        heading(0),
        tilt.deriv()(0),
        travel.deriv()(0) / p.wheel_radius - tilt.deriv()(0),
        heading.deriv()(0),
    )
    turning = tilt.deriv(2)(0), travel.deriv(2)(0) / p.wheel_radius - tilt.deriv(2)(0), 2.0
    acceleration = (velocity(1e-4) - velocity(-1e-4)) / 2e-4
    force = rotation(0).T @ (acceleration + np.array([0, 0, p.gravity]))
    np.testing.assert_allclose(specific_force(state, turning, lever, p), force, atol=1e-4)
    spin = rotation(0).T @ (rotation(1e-6) - rotation(-1e-6)) / 2e-6
    axes = [spin[2, 1], spin[0, 2], spin[1, 0]]
    np.testing.assert_allclose(angular_rate(state), axes, atol=1e-8)


def steps(linear: Linear) -> dict[str, list[float]]:
    """Return the numbers of (46)-(48) and (52) that follow from a linear model."""
    p = EDUMIP
    rise = np.array(linear[:4]) * (p.body_height + p.wheel_radius)
    rise += np.array(linear[4:8]) * p.wheel_radius
    return {
        "f4": [DT * linear[i] for i in (0, 1, 3, 2)],
        "f5": [1 + DT * linear[5], *(DT * linear[i] for i in (4, 7, 6))],
        "f6": [1 + DT * linear[8], DT * linear[9]],
        "a_y": [rise[2], rise[0] - p.gravity, rise[1], rise[3] - p.body_height],
    }


def test_the_printed_coefficients_follow_from_table_ii() -> None:
    found = steps(linearised_by_27(EDUMIP))
    f4, f5, a_y = found["f4"], found["f5"], found["a_y"]
    np.testing.assert_allclose([f4[0], f4[1], f4[3]], [0.629, 0.068, -2.72], rtol=5e-3)
    np.testing.assert_allclose([f5[0], f5[1], f5[3]], [0.813, -1.12, 7.47], rtol=5e-3)
    np.testing.assert_allclose(found["f6"], [0.939, 2.44], rtol=5e-3)
    np.testing.assert_allclose(a_y, [8.17, -7.41, -0.204, -0.0346], rtol=5e-3)
    # The printed 0.009 and -0.016 are neither those of (27) nor right: see the next two tests.
    assert (f4[2], f5[2]) == pytest.approx((0.00300, -0.00533), rel=5e-3)


def test_the_printed_yaw_terms_come_from_another_lever() -> None:
    """(46) and (47) follow where m_b (l + r)^2 stands for the l^2 m_b of (27)."""
    printed = linearised_as_printed(EDUMIP)
    found = [DT * printed.tilt_per_spin, DT * printed.wheel_per_spin]
    np.testing.assert_allclose(found, [0.009, -0.016], atol=0.0005)  # printed digits


def test_the_right_yaw_terms() -> None:
    found = steps(linearised(EDUMIP))
    assert found["f4"][2] == pytest.approx(0.00127, rel=5e-3)
    assert found["f5"][2] == pytest.approx(0.00162, rel=5e-3)
