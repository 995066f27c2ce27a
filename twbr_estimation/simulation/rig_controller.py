"""The balance controller of the rig: a sampled linear-quadratic regulator with delay."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..plants.laddach2022 import PlantParameters, PlantState, linearised

STATE_WEIGHTS = (3.06, 0.1, 31.3, 1.0)
"""Weights of position, velocity, tilt and tilt rate."""
VOLTAGE_WEIGHT = 0.058
"""Weight of the motor voltage."""


class BalanceGains(NamedTuple):
    """Voltage per unit of each state, and of the voltage still on its way."""

    position: float
    velocity: float
    tilt: float
    rate: float
    voltage: float


def balance_gains(plant: PlantParameters, period: float) -> BalanceGains:
    """Return the gains for the linearised plant, sampled, with one period of delay [s]."""
    from scipy.linalg import expm, solve_discrete_are

    a, b = linearised(plant)
    sampled = expm(np.block([[a, b], [np.zeros((1, 5))]]) * period)
    transition = np.zeros((5, 5))
    transition[:4] = sampled[:4]
    entry = np.zeros((5, 1))
    entry[4] = 1.0
    weights = np.diag([*STATE_WEIGHTS, 0.0])
    effort = np.array([[VOLTAGE_WEIGHT]])
    cost = solve_discrete_are(transition, entry, weights, effort)
    gains = np.linalg.solve(effort + entry.T @ cost @ entry, entry.T @ cost @ transition)
    return BalanceGains(*gains[0].tolist())


def balance_voltage(
    state: PlantState,
    target_position: float,
    target_velocity: float,
    pending: float,
    gains: BalanceGains,
    limit: float,
) -> float:
    """Return the voltage to apply one period later [V], limited to the supply."""
    voltage = (
        gains.position * (target_position - state.position)
        + gains.velocity * (target_velocity - state.velocity)
        - gains.tilt * state.tilt
        - gains.rate * state.rate
        - gains.voltage * pending
    )
    return min(max(voltage, -limit), limit)
