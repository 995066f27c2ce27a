"""The mobile inverted pendulum that turns fast, Sihite 2018 (4)-(32), in its right form.

The paper puts the rolling constraint into the Lagrangian, which is not valid for a constraint
that is not holonomic: the terms with the squared yaw rate come out wrong. Here they are derived
by Kane's method; a test lets sympy do it again with all constraints. Without yaw nothing differs.

The paper's theta, phi and psi are tilt (positive forward), wheels against the body (mean of both)
and heading (positive to the left); its wheel 1 is the right one. Its a_y, which points backward
and has the opposite sign of a specific force, is the forward specific force of REP-103.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..robot import Robot
from ..samples import STANDARD_GRAVITY

Triple = tuple[float, float, float]


class SpatialParameters(NamedTuple):
    """Masses, lengths and motors of the robot, SI units; Sihite 2018 Tables I and II."""

    body_mass: float
    """m_b [kg]."""
    body_height: float
    """l, axle to centre of mass [m]."""
    body_inertia: float
    """I_b1 about the centre of mass, pitch axis [kg m^2]."""
    body_inertia_roll: float
    """I_b2."""
    body_inertia_yaw: float
    """I_b3."""
    wheel_mass: float
    """m_w, of one wheel [kg]."""
    wheel_inertia: float
    """I_w1, about the axle [kg m^2]."""
    wheel_inertia_across: float
    """I_w2 = I_w3, about a diameter [kg m^2]."""
    wheel_radius: float
    """r [m]."""
    track_width: float
    """d, between the wheels [m]."""
    torque_gain: float
    """k_1, torque of one wheel per unit of its command [N m]; a robot's unit is a volt."""
    torque_damping: float
    """k_2, torque lost per rate of a wheel against the body [N m s/rad]."""
    gravity: float = STANDARD_GRAVITY
    """g [m/s^2]."""


EDUMIP = SpatialParameters(
    body_mass=0.218,
    body_height=0.046,
    body_inertia=5.91e-4,
    body_inertia_roll=2.99e-4,
    body_inertia_yaw=2.91e-4,
    wheel_mass=0.024,
    wheel_inertia=6.42e-5,
    wheel_inertia_across=7.48e-6,
    wheel_radius=0.035,
    track_width=0.07,
    torque_gain=0.12,
    torque_damping=0.003,
    gravity=9.8,
)
"""Table II; the command is the share of the largest voltage."""


class SpatialState(NamedTuple):
    """The state of (28)."""

    tilt: float
    """theta [rad]."""
    wheel: float
    """phi, mean of the wheels against the body [rad]."""
    heading: float
    """psi [rad]."""
    tilt_rate: float
    wheel_rate: float
    yaw_rate: float


class Commands(NamedTuple):
    """Inputs of the robot."""

    forward: float
    """u_x, mean of both motors' commands."""
    turn: float
    """u_z, half the difference of the right and the left motor's command."""
    push: float = 0.0
    """Horizontal force on the body's centre of mass [N]."""


class Linear(NamedTuple):
    """(27) solved for the accelerations, about upright: the numbers behind (46)-(48)."""

    tilt_per_tilt: float
    tilt_per_wheel_rate: float
    tilt_per_command: float
    tilt_per_spin: float
    """Tilt acceleration per tilt times squared yaw rate [1]."""
    wheel_per_tilt: float
    wheel_per_wheel_rate: float
    wheel_per_command: float
    wheel_per_spin: float
    yaw_per_yaw_rate: float
    yaw_per_command: float


def spatial_parameters(robot: "Robot") -> SpatialParameters:
    """Return the parameters of a robot; its commands are voltages."""
    gain = robot.gear_ratio * robot.torque_constant / robot.winding_resistance
    return SpatialParameters(
        body_mass=robot.body_mass,
        body_height=robot.body_height,
        body_inertia=robot.body_inertia,
        body_inertia_roll=robot.body_inertia_roll,
        body_inertia_yaw=robot.body_inertia_yaw,
        wheel_mass=robot.wheel_mass,
        wheel_inertia=robot.wheel_inertia,
        wheel_inertia_across=robot.wheel_inertia_across,
        wheel_radius=robot.wheel_radius,
        track_width=robot.track_width,
        torque_gain=gain,
        torque_damping=gain * robot.gear_ratio * robot.back_emf_constant,
    )


def accelerations(state: SpatialState, commands: Commands, p: SpatialParameters) -> Triple:
    """Return the accelerations of tilt, wheels and heading [rad/s^2] at any tilt."""
    sine, cosine = math.sin(state.tilt), math.cos(state.tilt)
    moment, radius = p.body_mass * p.body_height, p.wheel_radius
    spin, swing = state.yaw_rate * state.yaw_rate, state.tilt_rate * state.tilt_rate
    wheels = 2.0 * (p.wheel_mass * radius * radius + p.wheel_inertia)
    upper = p.body_inertia + moment * p.body_height
    m22 = p.body_mass * radius * radius + wheels
    m12 = m22 + moment * radius * cosine
    m11 = upper + m22 + 2.0 * moment * radius * cosine
    roll_yaw = p.body_inertia_roll - p.body_inertia_yaw
    b1 = moment * sine * (p.gravity + radius * swing)
    b1 += sine * (moment * (radius + p.body_height * cosine) + roll_yaw * cosine) * spin
    b1 += commands.push * (radius + p.body_height * cosine)
    b2 = 2.0 * (p.torque_gain * commands.forward - p.torque_damping * state.wheel_rate)
    b2 += moment * radius * sine * (swing + spin) + commands.push * radius
    determinant = m11 * m22 - m12 * m12
    tilt = (m22 * b1 - m12 * b2) / determinant
    wheel = (m11 * b2 - m12 * b1) / determinant
    return tilt, wheel, _yaw_acceleration(state, commands, p)


def _yaw_acceleration(state: SpatialState, commands: Commands, p: SpatialParameters) -> float:
    sine, cosine = math.sin(state.tilt), math.cos(state.tilt)
    moment, lever = p.body_mass * p.body_height, 0.5 * p.track_width / p.wheel_radius
    inertia = _yaw_inertia(p) - p.body_inertia_yaw * sine * sine
    inertia += (moment * p.body_height + p.body_inertia_roll) * sine * sine
    velocity = p.wheel_radius * (state.wheel_rate + state.tilt_rate)
    roll_yaw = p.body_inertia_roll - p.body_inertia_yaw
    torque = 2.0 * lever * p.torque_gain * commands.turn
    torque -= 2.0 * lever * lever * p.torque_damping * state.yaw_rate
    torque -= moment * sine * velocity * state.yaw_rate
    swing = 2.0 * sine * cosine * state.tilt_rate * state.yaw_rate
    torque -= (moment * p.body_height + roll_yaw) * swing
    return torque / inertia


def _yaw_inertia(p: SpatialParameters) -> float:
    """Return the moment of inertia about the vertical, upright, the wheels rolling [kg m^2]."""
    half = 0.5 * p.track_width
    rolling = p.wheel_mass + p.wheel_inertia / (p.wheel_radius * p.wheel_radius)
    return p.body_inertia_yaw + 2.0 * (p.wheel_inertia_across + rolling * half * half)


def specific_force(
    state: SpatialState, turning: Triple, lever: Triple, p: SpatialParameters
) -> Triple:
    """Return the specific force of an IMU at `lever`, body axes forward, left, up [m/s^2].

    Args:
        state: of the robot.
        turning: accelerations of tilt, wheels and heading, from `accelerations`.
        lever: position of the sensor from the middle of the axle, body axes [m].
        p: the robot.
    """
    sine, cosine = math.sin(state.tilt), math.cos(state.tilt)
    forward = p.wheel_radius * (turning[0] + turning[1])
    sideways = p.wheel_radius * (state.tilt_rate + state.wheel_rate) * state.yaw_rate
    wx, wy, wz = angular_rate(state)
    ax = -sine * turning[2] - cosine * state.yaw_rate * state.tilt_rate
    ay = turning[0]
    az = cosine * turning[2] - sine * state.yaw_rate * state.tilt_rate
    x, y, z = lever
    along = wx * x + wy * y + wz * z
    square = wx * wx + wy * wy + wz * wz
    return (
        forward * cosine - p.gravity * sine + ay * z - az * y + wx * along - square * x,
        sideways + az * x - ax * z + wy * along - square * y,
        forward * sine + p.gravity * cosine + ax * y - ay * x + wz * along - square * z,
    )


def angular_rate(state: SpatialState) -> Triple:
    """Return the rates of a gyro, body axes forward, left, up [rad/s], (9)."""
    sine, cosine = math.sin(state.tilt), math.cos(state.tilt)
    return -sine * state.yaw_rate, state.tilt_rate, cosine * state.yaw_rate


def linearised(p: SpatialParameters) -> Linear:
    """Return the linear model about upright; only tilt times squared yaw rate is kept besides."""
    tilt_spin = p.body_mass * p.body_height * (p.body_height + p.wheel_radius)
    tilt_spin += p.body_inertia_roll - p.body_inertia_yaw
    return _linear(p, tilt_spin, p.body_mass * p.body_height * p.wheel_radius)


def linearised_by_27(p: SpatialParameters) -> Linear:
    """Return the same with the terms of the squared yaw rate as in (27); (52) follows from it."""
    return _printed(p, p.body_height)


def linearised_as_printed(p: SpatialParameters) -> Linear:
    """Return the same as in (46), (47): (27) with l + r in place of l."""
    return _printed(p, p.body_height + p.wheel_radius)


def _printed(p: SpatialParameters, lever: float) -> Linear:
    tilt_spin = p.body_mass * lever * lever + p.body_inertia_roll - p.body_inertia_yaw
    return _linear(p, tilt_spin, 0.0)


def _linear(p: SpatialParameters, tilt_spin: float, wheel_spin: float) -> Linear:
    moment, radius = p.body_mass * p.body_height, p.wheel_radius
    wheels = 2.0 * (p.wheel_mass * radius * radius + p.wheel_inertia)
    m22 = p.body_mass * radius * radius + wheels
    m12 = m22 + moment * radius
    m11 = p.body_inertia + moment * p.body_height + m22 + 2.0 * moment * radius
    determinant = m11 * m22 - m12 * m12
    weight, drive, drag = moment * p.gravity, 2.0 * p.torque_gain, 2.0 * p.torque_damping
    lever, inertia = 0.5 * p.track_width / radius, _yaw_inertia(p)
    return Linear(
        tilt_per_tilt=m22 * weight / determinant,
        tilt_per_wheel_rate=m12 * drag / determinant,
        tilt_per_command=-m12 * drive / determinant,
        tilt_per_spin=(m22 * tilt_spin - m12 * wheel_spin) / determinant,
        wheel_per_tilt=-m12 * weight / determinant,
        wheel_per_wheel_rate=-m11 * drag / determinant,
        wheel_per_command=m11 * drive / determinant,
        wheel_per_spin=(m11 * wheel_spin - m12 * tilt_spin) / determinant,
        yaw_per_yaw_rate=-lever * lever * drag / inertia,
        yaw_per_command=lever * drive / inertia,
    )


def advance(
    state: SpatialState, commands: Commands, p: SpatialParameters, dt: float
) -> SpatialState:
    """Return the state `dt` [s] later, by the classical Runge-Kutta method."""
    half = 0.5 * dt
    first = accelerations(state, commands, p)
    second_state = _moved(state, state, first, half)
    second = accelerations(second_state, commands, p)
    third_state = _moved(state, second_state, second, half)
    third = accelerations(third_state, commands, p)
    last_state = _moved(state, third_state, third, dt)
    last = accelerations(last_state, commands, p)
    rates = _weighted(_rates(state), _rates(second_state), _rates(third_state), _rates(last_state))
    turning = _weighted(first, second, third, last)
    return SpatialState(
        state.tilt + dt * rates[0],
        state.wheel + dt * rates[1],
        state.heading + dt * rates[2],
        state.tilt_rate + dt * turning[0],
        state.wheel_rate + dt * turning[1],
        state.yaw_rate + dt * turning[2],
    )


def _moved(state: SpatialState, slope: SpatialState, turning: Triple, dt: float) -> SpatialState:
    return SpatialState(
        state.tilt + dt * slope.tilt_rate,
        state.wheel + dt * slope.wheel_rate,
        state.heading + dt * slope.yaw_rate,
        state.tilt_rate + dt * turning[0],
        state.wheel_rate + dt * turning[1],
        state.yaw_rate + dt * turning[2],
    )


def _rates(state: SpatialState) -> Triple:
    return state.tilt_rate, state.wheel_rate, state.yaw_rate


def _weighted(first: Triple, second: Triple, third: Triple, last: Triple) -> Triple:
    return (
        (first[0] + 2.0 * (second[0] + third[0]) + last[0]) / 6.0,
        (first[1] + 2.0 * (second[1] + third[1]) + last[1]) / 6.0,
        (first[2] + 2.0 * (second[2] + third[2]) + last[2]) / 6.0,
    )
