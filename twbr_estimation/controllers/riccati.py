"""Gains of a sampled linear-quadratic regulator whose voltage acts one period late."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import ConfigurationError
from ..plants.laddach2022 import PlantParameters, linearised


def delayed_gains(
    plant: PlantParameters, period: float, state_weights: Sequence[float], voltage_weight: float
) -> tuple[float, float, float, float, float]:
    """Return the voltage per unit of each state, and of the voltage still on its way.

    The linearised plant, Laddach 2022 (2), is sampled; the pending voltage is a fifth state.

    Args:
        plant: the robot's mechanics.
        period: sampling period [s].
        state_weights: of position, velocity, tilt and tilt rate.
        voltage_weight: of the voltage.

    Raises:
        ConfigurationError: the Riccati equation has no stabilising solution.
    """
    from scipy.linalg import expm, solve_discrete_are  # slow to import, seldom needed

    a, b = linearised(plant)
    sampled = expm(np.block([[a, b], [np.zeros((1, 5))]]) * period)
    transition = np.zeros((5, 5))
    transition[:4] = sampled[:4]
    entry = np.zeros((5, 1))
    entry[4] = 1.0
    weights, effort = np.diag([*state_weights, 0.0]), np.array([[voltage_weight]])
    try:
        cost = solve_discrete_are(transition, entry, weights, effort)
        gains = np.linalg.solve(effort + entry.T @ cost @ entry, entry.T @ cost @ transition)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ConfigurationError(f"no gains for this robot and period: {error}") from error
    position, velocity, tilt, rate, pending = gains[0].tolist()
    return position, velocity, tilt, rate, pending
