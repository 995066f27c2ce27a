"""Angles in arrays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

TURN = 2.0 * math.pi
"""One turn [rad]."""


def wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles [rad] within +-pi, in the shape given."""
    return np.asarray(angles - TURN * np.round(angles / TURN), dtype=np.float64)
