"""The interface of a peer: another project's estimator of attitude from gyro and accelerometer."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..recording import FloatArray


class Inertial(NamedTuple):
    """Input of a peer: corrected samples in body axes, evenly spaced."""

    gyro: FloatArray
    """Angular rate [rad/s], (n, 3)."""
    accel: FloatArray
    """Specific force [m/s^2], (n, 3)."""
    period: float
    """Mean sampling period [s]."""


class Peer(NamedTuple):
    """One estimator; `run` imports its package and raises ImportError without it."""

    name: str
    """In tables."""
    package: str
    """What to install for it."""
    run: Callable[[Inertial], FloatArray]
    """run(samples): quaternions w, x, y, z from body to world, z up, (n, 4)."""


SETTLING_TIME = 3.0
"""Time constant [s] for peers whose weights have no default: that of VQF's default."""
GYRO_NOISE = 0.0018
"""Standard deviation of a corrected rate [rad/s], for peers that need one."""


def level_attitude(force: FloatArray) -> tuple[float, float, float, float]:
    """Return the attitude w, x, y, z without heading that turns a specific force upright.

    Args:
        force: first specific force of a recording [m/s^2], (3,).
    """
    x, y, z = force / max(float(np.linalg.norm(force)), 1e-9)
    if z < -0.999999:
        return 0.0, 1.0, 0.0, 0.0
    # The shortest turn from (x, y, z) to (0, 0, 1): its axis is their cross product.
    w = float(np.sqrt(0.5 * (1.0 + z)))
    return w, float(0.5 * y / w), float(-0.5 * x / w), 0.0
