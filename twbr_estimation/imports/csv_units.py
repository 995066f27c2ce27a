"""Units that the columns of a log may have, by what they hold, the usual one first."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..samples import STANDARD_GRAVITY

_TURN = 2.0 * math.pi
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "d": 86400.0}
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": _TIMES,
    "arrival": _TIMES,
    "gyro": {"rad/s": 1.0, "deg/s": math.radians(1.0), "LSB": math.radians(1.0)},
    "accel": {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "LSB": STANDARD_GRAVITY},
    "wheels": {"rad": 1.0, "deg": math.radians(1.0), "counts": _TURN},
    "wheel_speeds": {
        "rad/s": 1.0,
        "deg/s": math.radians(1.0),
        "rpm": _TURN / 60.0,
        "counts/s": _TURN,
        "m/s": 1.0,
        "mm/s": 1e-3,
    },
    "reference": {"rad": 1.0, "deg": math.radians(1.0), "counts": _TURN},
    "temperature": {"degC": 1.0},
    "motors": {"V": 1.0, "mV": 1e-3},
    "estimates": {"rad": 1.0, "deg": math.radians(1.0)},
}
"""SI value of one unit; LSB and counts are divided by what `DIVISORS` names, and a speed over the
ground by the wheel radius."""
DIVISORS = {"LSB": "lsb_per", "counts": "counts_per_turn", "counts/s": "counts_per_turn"}
"""Section of the description with the number of counts in the unit's SI value."""
