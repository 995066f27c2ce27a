"""One step of the rig: plant, controller, contacts, and the shaking of the frame.

Everything is a function of named tuples and floats, so that a batch compiles the loop and a
closed loop takes one step at a time.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..plants.laddach2022 import (
    Loads,
    PlantParameters,
    PlantState,
    advance,
    back_emf,
    stop_axle,
    stop_body,
    tilt_inertia,
)
from ..samples import STANDARD_GRAVITY
from ..sensors.error_model import Triple
from .disturbances import STEP
from .planar_sensing import PlanarMotion
from .rig_controller import BalanceGains, balance_voltage

PUSH_HEIGHT = 0.18
"""Height above the axle at which pushes act [m]."""
STOP_TILT = 0.635
"""Tilt at which the frame hits the hard stops [rad]."""
STOP_RESTITUTION = 0.15
OBSTACLE_RESTITUTION = 0.4
OBSTACLE_SPEED = 0.3
"""Lowest speed at which an obstacle has an effect [m/s]."""
LYING_SECONDS = 0.25
"""Time on the ground before the robot is stood up again [s]."""
DRAG = 20.0
"""Resistance to rolling while the robot is on the ground or held [N s/m]."""
LIFT_FREQUENCY = 8.0
"""Natural frequency of the hand that stands it up [rad/s]."""
UPRIGHT_TILT, UPRIGHT_RATE = 0.03, 0.2
"""Largest tilt and rate at which the hand releases the robot [rad], [rad/s]."""
VIBRATION_LEVEL = 0.15
"""Vibration at unit level [m/s^2]."""
BUMP_LEVEL = 0.45
"""Vertical road acceleration per speed [m/s^2 per m/s]."""
RING_FREQUENCY = 2.0 * math.pi * 70.0
"""Ringing of the frame after a shock [rad/s]."""
RING_DAMPING = 0.06
RING_SHARE = 0.02
"""Share of a shock's change of velocity that rings."""

BALANCING, LYING, LIFTED = 0, 1, 2


class Inputs(NamedTuple):
    """The disturbances of one step; see `Disturbances`."""

    push: float
    slope: float
    hit: float
    target: float
    target_speed: float
    bump: float
    slip: float


class Ring(NamedTuple):
    """A damped oscillation along one axis: displacement [m] and velocity [m/s]."""

    displacement: float = 0.0
    velocity: float = 0.0


class RigState(NamedTuple):
    """The rig between two steps."""

    plant: PlantState = PlantState(0.0, 0.0, 0.0, 0.0)
    wheel_travel: float = 0.0
    """Distance the tread has rolled, slip included [m]."""
    mode: int = BALANCING
    timer: float = 0.0
    """Time left on the ground [s]."""
    origin: float = 0.0
    """Position the commands count from [m]."""
    obstacle: bool = False
    """Whether an obstacle is ahead."""
    falls: int = 0
    ring_forward: Ring = Ring()
    ring_up: Ring = Ring()


def loads(state: RigState, inputs: Inputs, plant: PlantParameters) -> Loads:
    """Return what acts on the plant during one step."""
    weight = (plant.body_mass + 2.0 * plant.wheel_mass) * STANDARD_GRAVITY
    gravity = STANDARD_GRAVITY + inputs.bump * BUMP_LEVEL * abs(state.plant.velocity)
    force = -weight * inputs.slope
    moment = 0.0
    if state.mode != BALANCING:
        force -= DRAG * state.plant.velocity
    if state.mode == LIFTED:
        moment = _lifting_moment(state.plant, plant)
    return Loads(force, inputs.push, PUSH_HEIGHT, moment, gravity)


def _lifting_moment(state: PlantState, plant: PlantParameters) -> float:
    """Return the moment of a hand that brings the robot upright without overshoot [N m]."""
    pull = LIFT_FREQUENCY * (LIFT_FREQUENCY * state.tilt + 2.0 * state.rate)
    weight = plant.body_mass * plant.body_height * STANDARD_GRAVITY * math.sin(state.tilt)
    return -tilt_inertia(plant) * pull - weight


def step(
    state: RigState, inputs: Inputs, voltage: float, acting: Loads, plant: PlantParameters
) -> RigState:
    """Advance the rig by one `STEP`: motion, then contacts, then who holds the robot."""
    coasting = state.mode != BALANCING
    applied = back_emf(state.plant, plant) if coasting else voltage
    moved = advance(state.plant, applied, acting, plant, STEP)
    travel = state.wheel_travel + moved.position - state.plant.position + inputs.slip * STEP
    touched, obstacle, stopped = _contacts(moved, state.obstacle or inputs.hit > 0.0, plant)
    shock = touched.velocity - moved.velocity
    jerk = plant.body_height * (touched.rate - moved.rate)
    mode, timer, origin = _held(state, touched, stopped)
    return RigState(
        touched,
        travel,
        mode,
        timer,
        origin,
        obstacle,
        state.falls + (1 if stopped and not coasting else 0),
        rung(state.ring_forward, shock + 2.0 * jerk),
        rung(state.ring_up, 0.5 * (jerk - shock)),
    )


def _contacts(
    moved: PlantState, obstacle: bool, plant: PlantParameters
) -> tuple[PlantState, bool, bool]:
    """Return the state after impacts, if an obstacle is still ahead, if a stop was hit."""
    if obstacle and abs(moved.velocity) > OBSTACLE_SPEED:
        moved = stop_axle(moved, OBSTACLE_RESTITUTION, plant)
        obstacle = False
    stopped = abs(moved.tilt) >= STOP_TILT and moved.tilt * moved.rate > 0.0
    if stopped:
        moved = stop_body(moved, STOP_RESTITUTION, plant)
    return moved, obstacle, stopped


def _held(state: RigState, plant: PlantState, stopped: bool) -> tuple[int, float, float]:
    """Return mode, timer and origin after a step."""
    if state.mode == BALANCING and stopped:
        return LYING, LYING_SECONDS, state.origin
    if state.mode == LYING:
        left = state.timer - STEP
        return (LYING if left > 0.0 else LIFTED), left, state.origin
    upright = abs(plant.tilt) < UPRIGHT_TILT and abs(plant.rate) < UPRIGHT_RATE
    if state.mode == LIFTED and upright:
        return BALANCING, 0.0, plant.position
    return state.mode, state.timer, state.origin


def rung(ring: Ring, shock: float) -> Ring:
    """Return a ring one step later, exactly for the free oscillation."""
    damping = RING_DAMPING * RING_FREQUENCY
    turn = RING_FREQUENCY * math.sqrt(1.0 - RING_DAMPING * RING_DAMPING)
    decay = math.exp(-damping * STEP)
    cosine, sine = decay * math.cos(turn * STEP), decay * math.sin(turn * STEP) / turn
    x, v = ring.displacement, ring.velocity + RING_SHARE * shock
    stiffness = RING_FREQUENCY * RING_FREQUENCY
    return Ring(
        cosine * x + sine * (v + damping * x), cosine * v - sine * (damping * v + stiffness * x)
    )


def ring_acceleration(ring: Ring) -> float:
    """Return the acceleration of a ring [m/s^2]."""
    stiffness = RING_FREQUENCY * RING_FREQUENCY * ring.displacement
    return -stiffness - 2.0 * RING_DAMPING * RING_FREQUENCY * ring.velocity


def motion_of(state: RigState, acting: Loads, voltage: float, vibration: Triple) -> PlanarMotion:
    """Return how the robot moves after a step.

    Args:
        state: after the step.
        acting: the loads during the step.
        voltage: the motors' voltage during the step [V].
        vibration: frame vibration at unit level, forward, left, up.
    """
    moving = state.plant
    level = VIBRATION_LEVEL * (0.05 + abs(moving.velocity) / 0.5 + 0.6 * abs(voltage) / 12.0)
    return PlanarMotion(
        moving.velocity,
        moving.tilt,
        moving.rate,
        acting.gravity - STANDARD_GRAVITY,
        level * vibration[0] + ring_acceleration(state.ring_forward),
        level * vibration[1],
        level * vibration[2] + ring_acceleration(state.ring_up),
        state.wheel_travel,
    )


def stretch(
    state: RigState,
    inputs: Any,
    vibration: Any,
    voltage: float,
    plant: PlantParameters,
    motion: Any,
) -> RigState:
    """Take n steps under one voltage.

    Args:
        state: before.
        inputs: the disturbances of each step, n rows in the order of `Inputs`.
        vibration: at unit level after each step, n rows of forward, left, up.
        voltage: of the motors [V].
        plant: the robot.
        motion: n rows that receive the fields of `PlanarMotion` after each step.

    Rows of an array, or lists of floats, which are faster where this runs interpreted.
    """
    for i in range(len(inputs)):
        row, shake = inputs[i], vibration[i]
        now = Inputs(row[0], row[1], row[2], row[3], row[4], row[5], row[6])
        acting = loads(state, now, plant)
        state = step(state, now, voltage, acting, plant)
        moved = motion_of(state, acting, voltage, (shake[0], shake[1], shake[2]))
        for column in range(len(moved)):
            motion[i][column] = moved[column]
    return state


def next_voltage(
    state: RigState, inputs: Inputs, pending: float, gains: BalanceGains, limit: float
) -> float:
    """Return the balance controller's output; zero while the robot is held."""
    if state.mode != BALANCING:
        return 0.0
    target = state.origin + inputs.target
    return balance_voltage(state.plant, target, inputs.target_speed, pending, gains, limit)
