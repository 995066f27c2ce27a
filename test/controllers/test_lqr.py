"""The printed gains of Sun 2014, the right ones, and those of the user's own robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.controllers import controller_named
from twbr_estimation.controllers.lqr import Parameters, derive
from twbr_estimation.plants.laddach2022 import linearised
from twbr_estimation.plants.sun2014 import PRINTED, RodParameters, coefficients, matrices
from twbr_estimation.robot import Robot
from twbr_estimation.simulation.rig_controller import STATE_WEIGHTS, VOLTAGE_WEIGHT, balance_gains

control = pytest.importorskip("control", reason="needs python-control")
FIRST, SECOND = (1.0, 1.0, 1.0, 1.0), (100.0, 1.0, 100.0, 1.0)
RIGHT = coefficients(RodParameters())


@pytest.mark.parametrize(
    ("model", "weights", "expected"),
    [
        (PRINTED, FIRST, (27.5841, 2.9604, -1.0, -1.5277)),
        (PRINTED, SECOND, (44.617, 4.7724, -10.0, -5.2005)),
        (RIGHT, FIRST, (16.7824, 2.6443, -1.0, -1.7958)),
        (RIGHT, SECOND, (31.6556, 5.1479, -10.0, -7.3214)),
    ],
)
def test_the_gains_of_the_model_in_the_paper(model, weights, expected):
    gains, _, _ = control.lqr(*matrices(model), np.diag(weights), [[1.0]])
    np.testing.assert_allclose(gains[0], expected, atol=5.1e-5)


@pytest.mark.parametrize(
    ("name", "model"), [("lqr_sun2014", RIGHT), ("lqr_sun2014_printed", PRINTED)]
)
def test_the_controllers_defaults_are_those_gains(name, model):
    gains, _, _ = control.lqr(*matrices(model), np.diag(SECOND), [[1.0]])
    np.testing.assert_allclose(controller_named(name).configure()[:4], gains[0], atol=5.1e-5)


def test_force_and_voltage_agree_with_the_motors():
    """The voltage of the force law makes just that force at the wheels, in any state."""
    robot = Robot()
    entry = controller_named("lqr_sun2014")
    gains = entry.derive(entry.configure(), robot, 0.005)
    tilt, rate, position, velocity = 0.1, -0.4, 0.05, 0.3
    voltage = (
        gains.tilt * tilt
        + gains.rate * rate
        + gains.position * position
        + gains.velocity * velocity
    )
    from twbr_estimation.plants.laddach2022 import PlantState, motor_torque

    torque = motor_torque(PlantState(position, velocity, tilt, rate), voltage, robot.plant())
    right = entry.configure()
    force = right.tilt_gain * tilt + right.rate_gain * rate
    force -= right.position_gain * position + right.velocity_gain * velocity
    assert torque / robot.wheel_radius == pytest.approx(force)


@pytest.mark.parametrize("period", [0.0005, 0.005, 0.02])
def test_the_gains_are_those_of_python_control(period):
    a, b = linearised(Robot().plant())
    sampled = control.sample_system(control.ss(a, b, np.eye(4), np.zeros((4, 1))), period)
    transition, entry = np.zeros((5, 5)), np.zeros((5, 1))
    transition[:4, :4], transition[:4, 4:], entry[4] = sampled.A, sampled.B, 1.0
    weights = np.diag([*STATE_WEIGHTS, 0.0])
    expected, _, _ = control.dlqr(transition, entry, weights, [[VOLTAGE_WEIGHT]])
    rig = Parameters(*STATE_WEIGHTS, VOLTAGE_WEIGHT)
    gains, of_rig = derive(rig, Robot(), period), balance_gains(Robot().plant(), period)
    found = [gains.position, gains.velocity, gains.tilt, gains.rate, gains.pending]
    np.testing.assert_allclose(found, -expected[0], rtol=1e-6)
    np.testing.assert_allclose(found, -np.array(of_rig), rtol=1e-12)


def test_another_robot_gets_other_gains_that_stabilise_it():
    tall = replace(Robot(), body_mass=3.0, body_height=0.3, body_inertia=0.06, supply_voltage=24.0)
    gains = derive(Parameters(), tall, 0.005)
    assert gains.limit == 24.0
    assert gains.tilt > 1.5 * derive(Parameters(), Robot(), 0.005).tilt
