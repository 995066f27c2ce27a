from __future__ import annotations

import pytest

from twbr_estimation.controllers import ControlInput, controller_named
from twbr_estimation.robot import Robot

PERIOD = 0.01
ENTRY = controller_named("pid")
STILL = ControlInput(PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def prepared(**values: float):
    quiet = dict.fromkeys((p.name for p in ENTRY.declared()), 0.0) | {"largest_lean": 0.3}
    return ENTRY.derive(ENTRY.configure(quiet | values), Robot(), PERIOD)


def test_the_integral_is_trapezoidal():
    coefficients = prepared(tilt_integral=10.0)
    state = ENTRY.reset(STILL, coefficients)
    for k in range(1, 101):  # tilt = t: the integral of the trapezoids is exact, t^2 / 2
        state = ENTRY.step(state, STILL._replace(tilt=k * PERIOD), coefficients)
    assert state.left == pytest.approx(10.0 * 0.5, rel=1e-12)


def test_a_full_motor_winds_nothing_up():
    coefficients = prepared(tilt_gain=100.0, tilt_integral=100.0)
    state = ENTRY.reset(STILL, coefficients)
    for _ in range(500):
        state = ENTRY.step(state, STILL._replace(tilt=0.5), coefficients)
    assert state.left == 12.0
    state = ENTRY.step(state, STILL._replace(tilt=-0.05), coefficients)
    assert state.left < 0.0


def test_the_lean_is_limited_and_its_integral_waits():
    coefficients = prepared(tilt_gain=10.0, speed_gain=1.0, speed_integral=5.0)
    fast = STILL._replace(velocity=3.0)
    state = ENTRY.reset(fast, coefficients)
    for _ in range(500):
        state = ENTRY.step(state, fast, coefficients)
    assert state.left == pytest.approx(10.0 * 0.3)  # lean back by the limit: drive forward
    state = ENTRY.step(state, STILL._replace(velocity=-0.1), coefficients)
    lean = 0.1 + 5.0 * PERIOD * 0.5 * (0.1 - 3.0)  # nothing was stored while the lean was full
    assert state.left == pytest.approx(-10.0 * lean)


def test_the_signs():
    coefficients = prepared(tilt_gain=10.0, tilt_derivative=1.0, speed_gain=1.0)
    state = ENTRY.reset(STILL, coefficients)
    for change in ({"tilt": 0.1}, {"rate": 0.1}, {"velocity": 0.1}):
        assert ENTRY.step(state, STILL._replace(**change), coefficients).left > 0.0
    assert ENTRY.step(state, STILL._replace(target_velocity=0.1), coefficients).left < 0.0
