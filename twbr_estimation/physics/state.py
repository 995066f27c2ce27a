"""States of the engine, one a step, and angles, rates and speeds from them.

Attitudes are heading about the vertical, roll of the axle about the heading, tilt about the
axle, as in `simulation.spatial_sensing`: the tilt is atan2(-u_x, u_z) with u the up direction in
body axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..recording import FloatArray

COLUMNS = 17
POSITION, ATTITUDE, WHEELS = slice(0, 3), slice(3, 7), slice(7, 9)
"""Middle of the axle in the world [m]; quaternion w, x, y, z; wheels against the body [rad]."""
VELOCITY, RATE, WHEEL_RATES = slice(9, 12), slice(12, 15), slice(15, 17)
"""Of the axle in the world [m/s]; of the body in its own axes [rad/s]; of the wheels [rad/s]."""


class Moving(NamedTuple):
    """Motion of the robot at one instant."""

    tilt: float
    """[rad], positive leaning forward."""
    rate: float
    """Its rate [rad/s]."""
    roll: float
    """Of the axle, positive with the left wheel up [rad]."""
    heading: float
    """[rad], positive to the left."""
    yaw_rate: float
    """About the vertical [rad/s]."""
    velocity: float
    """Of the axle along its heading [m/s]."""


def moving(row: Sequence[float]) -> Moving:
    """Return angles and speeds of one row of `COLUMNS` numbers."""
    w, x, y, z = row[3:7]
    p, q, r = row[12:15]
    ux, uy, uz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    level = max(ux * ux + uz * uz, 1e-12)
    heading = math.atan2(-2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z))
    return Moving(
        tilt=math.atan2(-ux, uz),
        rate=q - uy * (p * ux + r * uz) / level,
        roll=math.asin(min(max(uy, -1.0), 1.0)),
        heading=heading,
        yaw_rate=p * ux + q * uy + r * uz,
        velocity=row[9] * math.cos(heading) + row[10] * math.sin(heading),
    )


def tilts(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return tilt [rad], without jumps, and tilt rate [rad/s] of n rows, (n,) each."""
    up = rotations(rows)[:, 2]
    level = np.maximum(up[:, 0] ** 2 + up[:, 2] ** 2, 1e-12)
    rate = rows[:, RATE]
    turning = rate[:, 1] - up[:, 1] * (rate[:, 0] * up[:, 0] + rate[:, 2] * up[:, 2]) / level
    return np.unwrap(np.arctan2(-up[:, 0], up[:, 2])), turning


def rotations(rows: FloatArray) -> FloatArray:
    """Return the rotations from body to world, (n, 3, 3)."""
    w, x, y, z = rows[:, ATTITUDE].T
    columns = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(columns), -1, 0)


def quaternion(heading: float, roll: float, tilt: float) -> tuple[float, float, float, float]:
    """Return the attitude w, x, y, z of three angles [rad]."""
    (sh, ch), (sr, cr), (st, ct) = (
        (math.sin(0.5 * angle), math.cos(0.5 * angle)) for angle in (heading, roll, tilt)
    )
    w, x, y, z = ch * cr, ch * sr, sh * sr, sh * cr  # heading, then roll
    return w * ct - y * st, x * ct - z * st, w * st + y * ct, x * st + z * ct
