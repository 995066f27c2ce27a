from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from twbr_estimation.plants.laddach2022 import (
    Loads,
    PlantState,
    accelerations,
    advance,
    linearised,
    rolling_mass,
    stop_axle,
    stop_body,
    tilt_inertia,
)
from twbr_estimation.robot import Robot
from twbr_estimation.samples import STANDARD_GRAVITY

ROBOT = Robot().plant()
FREE = ROBOT._replace(torque_constant=0.0)
"""The robot with motors that neither drive nor brake."""
REST = Loads(0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)


def energy(state: PlantState) -> float:
    first_moment = ROBOT.body_mass * ROBOT.body_height
    kinetic = 0.5 * rolling_mass(ROBOT) * state.velocity**2
    kinetic += 0.5 * tilt_inertia(ROBOT) * state.rate**2
    kinetic += first_moment * math.cos(state.tilt) * state.velocity * state.rate
    return kinetic + first_moment * STANDARD_GRAVITY * math.cos(state.tilt)


def test_open_loop_poles():
    poles = np.sort(np.linalg.eigvals(linearised(ROBOT)[0]).real)
    np.testing.assert_allclose(poles, [-165.0, -6.14, 0.0, 6.81], rtol=2e-3, atol=1e-9)


def test_free_motion_keeps_its_energy():
    state = PlantState(0.0, 0.3, 0.4, -1.0)
    before = energy(state)
    for _ in range(2000):
        state = advance(state, 0.0, REST, FREE, 0.0005)
    assert abs(state.tilt) > 1.0
    assert energy(state) == pytest.approx(before, rel=1e-8)


def test_small_motion_follows_the_linear_model():
    a, b = linearised(ROBOT)
    state, voltage = PlantState(0.0, 0.01, 1e-3, -0.005), 0.05
    system = np.block([[a, b], [np.zeros((1, 5))]])
    expected = expm(system * 0.1)[:4] @ [*state, voltage]
    for _ in range(200):
        state = advance(state, voltage, REST, ROBOT, 0.0005)
    np.testing.assert_allclose(state, expected, rtol=2e-3, atol=1e-6)


def test_fourth_order_convergence():
    start = PlantState(0.0, 0.2, 0.3, 1.0)

    def after(steps: int) -> np.ndarray:
        state = start
        for _ in range(steps):
            state = advance(state, 3.0, REST, ROBOT, 0.04 / steps)
        return np.array(state)

    exact = after(1280)
    ratio = np.linalg.norm(after(40) - exact) / np.linalg.norm(after(80) - exact)
    assert ratio == pytest.approx(16.0, rel=0.2)


def test_positive_voltage_drives_forward_and_leans_the_body_back():
    linear, angular = accelerations(PlantState(0.0, 0.0, 0.0, 0.0), 1.0, REST, ROBOT)
    assert linear > 0.0 > angular


def test_a_push_from_behind_drives_and_leans_forward():
    push = REST._replace(push_force=1.0, push_height=0.18)
    linear, angular = accelerations(PlantState(0.0, 0.0, 0.0, 0.0), 0.0, push, FREE)
    assert angular > 0.0
    force = rolling_mass(FREE) * linear + FREE.body_mass * FREE.body_height * angular
    assert force == pytest.approx(1.0)


def test_impacts_reverse_speed_and_conserve_what_no_impulse_acts_on():
    state = PlantState(0.1, 0.5, 0.2, -1.0)
    first_moment = ROBOT.body_mass * ROBOT.body_height * math.cos(state.tilt)
    axle = stop_axle(state, 0.4, ROBOT)
    assert axle.velocity == pytest.approx(-0.4 * 0.5)
    spin = [tilt_inertia(ROBOT) * s.rate + first_moment * s.velocity for s in (state, axle)]
    assert spin[0] == pytest.approx(spin[1])
    body = stop_body(state, 0.15, ROBOT)
    assert body.rate == pytest.approx(0.15)
    push = [rolling_mass(ROBOT) * s.velocity + first_moment * s.rate for s in (state, body)]
    assert push[0] == pytest.approx(push[1])
