"""The two-wheeled balancing robot as a plant: Laddach 2022, eq. (2), in its right form.

Printed, (2) loses the second derivative of the position in both rows, and the gear ratio in
the reaction torque. Derived again: both geared motors turn the wheels with the torque
T = 2 k k_m / R_winding (u - k_e k (v / r - phi')), -T acts on the body, T / r on the ground.

Tilt is positive leaning forward and speed positive driving forward, as in REP-103. The
functions take and return named tuples of floats, so they run interpreted or compiled.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..samples import STANDARD_GRAVITY


class PlantParameters(NamedTuple):
    """Masses, lengths and motors, SI units; `Robot.plant` gives those of a robot."""

    body_mass: float
    """m_n [kg]."""
    body_height: float
    """l, axle to centre of mass [m]."""
    body_inertia: float
    """I_n about the centre of mass [kg m^2]."""
    wheel_mass: float
    """m_k, of one wheel [kg]."""
    wheel_inertia: float
    """I_k, of one wheel [kg m^2]."""
    wheel_radius: float
    """r [m]."""
    gear_ratio: float
    """k, motor turns per wheel turn."""
    winding_resistance: float
    """R of one motor [ohm]."""
    torque_constant: float
    """k_m [N m/A]."""
    back_emf_constant: float
    """k_e [V s/rad]."""
    supply_voltage: float
    """Largest motor voltage [V]."""


class PlantState(NamedTuple):
    """Position of the axle and tilt of the body, and their rates."""

    position: float
    """Axle position [m], positive forward."""
    velocity: float
    """Axle velocity [m/s]."""
    tilt: float
    """Tilt [rad], positive forward."""
    rate: float
    """Tilt rate [rad/s]."""


class Loads(NamedTuple):
    """Forces on the robot besides its motors, constant over one step."""

    axle_force: float
    """Horizontal force on the axle [N]."""
    push_force: float
    """Horizontal force on the body [N]."""
    push_height: float
    """Distance of the push from the axle, along the body [m]."""
    moment: float
    """Moment on the body [N m]."""
    gravity: float
    """Gravity plus the axle's vertical acceleration [m/s^2]."""


def tilt_inertia(parameters: PlantParameters) -> float:
    """Return the body's moment of inertia about the axle, I_n + m_n l^2 [kg m^2]."""
    return parameters.body_inertia + parameters.body_mass * parameters.body_height**2


def rolling_mass(parameters: PlantParameters) -> float:
    """Return the effective mass along the ground, w of (2) [kg]."""
    wheel = parameters.wheel_mass + parameters.wheel_inertia / parameters.wheel_radius**2
    return parameters.body_mass + 2.0 * wheel


def back_emf(state: PlantState, parameters: PlantParameters) -> float:
    """Return the voltage at which the motors neither drive nor brake [V]."""
    wheel_rate = state.velocity / parameters.wheel_radius - state.rate
    return parameters.back_emf_constant * parameters.gear_ratio * wheel_rate


def motor_torque(state: PlantState, voltage: float, parameters: PlantParameters) -> float:
    """Return the torque of both motors on the wheels [N m]."""
    gain = parameters.gear_ratio * parameters.torque_constant / parameters.winding_resistance
    return 2.0 * gain * (voltage - back_emf(state, parameters))


def accelerations(
    state: PlantState, voltage: float, loads: Loads, parameters: PlantParameters
) -> tuple[float, float]:
    """Return linear [m/s^2] and angular [rad/s^2] acceleration, eq. (2) solved for both."""
    sine, cosine = math.sin(state.tilt), math.cos(state.tilt)
    first_moment = parameters.body_mass * parameters.body_height
    coupling = first_moment * cosine
    inertia, mass = tilt_inertia(parameters), rolling_mass(parameters)
    torque = motor_torque(state, voltage, parameters)
    turning = first_moment * loads.gravity * sine - torque + loads.moment
    turning += loads.push_force * loads.push_height * cosine
    driving = first_moment * state.rate**2 * sine + torque / parameters.wheel_radius
    driving += loads.push_force + loads.axle_force
    determinant = inertia * mass - coupling * coupling
    linear = (inertia * driving - coupling * turning) / determinant
    angular = (mass * turning - coupling * driving) / determinant
    return linear, angular


def advance(
    state: PlantState, voltage: float, loads: Loads, parameters: PlantParameters, dt: float
) -> PlantState:
    """Return the state `dt` [s] later, by the classical Runge-Kutta method.

    The fastest open-loop pole is near -165 /s: keep `dt` below about 2 ms.
    """
    x, v, tilt, rate = state
    half = 0.5 * dt
    a1, w1 = accelerations(state, voltage, loads, parameters)
    second = PlantState(x + half * v, v + half * a1, tilt + half * rate, rate + half * w1)
    a2, w2 = accelerations(second, voltage, loads, parameters)
    third = PlantState(
        x + half * second.velocity, v + half * a2, tilt + half * second.rate, rate + half * w2
    )
    a3, w3 = accelerations(third, voltage, loads, parameters)
    fourth = PlantState(
        x + dt * third.velocity, v + dt * a3, tilt + dt * third.rate, rate + dt * w3
    )
    a4, w4 = accelerations(fourth, voltage, loads, parameters)
    sixth = dt / 6.0
    return PlantState(
        x + sixth * (v + 2.0 * (second.velocity + third.velocity) + fourth.velocity),
        v + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        tilt + sixth * (rate + 2.0 * (second.rate + third.rate) + fourth.rate),
        rate + sixth * (w1 + 2.0 * (w2 + w3) + w4),
    )


def stop_axle(state: PlantState, restitution: float, parameters: PlantParameters) -> PlantState:
    """Return the state after the wheels hit an obstacle: no impulsive moment on the body."""
    change = -(1.0 + restitution) * state.velocity
    coupling = parameters.body_mass * parameters.body_height * math.cos(state.tilt)
    rate = state.rate - coupling / tilt_inertia(parameters) * change
    return PlantState(state.position, state.velocity + change, state.tilt, rate)


def stop_body(state: PlantState, restitution: float, parameters: PlantParameters) -> PlantState:
    """Return the state after the body hits a hard stop: no impulsive force along the ground."""
    change = -(1.0 + restitution) * state.rate
    coupling = parameters.body_mass * parameters.body_height * math.cos(state.tilt)
    velocity = state.velocity - coupling / rolling_mass(parameters) * change
    return PlantState(state.position, velocity, state.tilt, state.rate + change)


def linearised(
    parameters: PlantParameters,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return A (4, 4) and B (4, 1) about upright rest; state as in `PlantState`, input [V]."""
    rest = Loads(0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)
    step = 1e-6

    def slopes(index: int, voltage: float) -> NDArray[np.float64]:
        values = np.zeros(4)
        if index < 4:
            values[index] = step
        state = PlantState(*values.tolist())
        linear, angular = accelerations(state, voltage, rest, parameters)
        return np.array([state.velocity, linear, state.rate, angular]) / step

    a = np.stack([slopes(index, 0.0) for index in range(4)], axis=1)
    return a, slopes(4, step)[:, None]
