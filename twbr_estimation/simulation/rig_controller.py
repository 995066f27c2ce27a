"""The balance controller of the rig: a sampled linear-quadratic regulator with delay."""

from __future__ import annotations

from typing import NamedTuple

from ..controllers.riccati import delayed_gains
from ..plants.laddach2022 import PlantParameters, PlantState

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
    return BalanceGains(*delayed_gains(plant, period, STATE_WEIGHTS, VOLTAGE_WEIGHT))


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
