"""The linear-quadratic regulator of Sun 2014 with the gains as printed.

They were computed from a wrong A1: the right plant still stands with them, but rings.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from .lqr_sun2014 import CONTROLLER as RIGHT
from .lqr_sun2014 import PositionGain, RateGain, TiltGain, VelocityGain
from .steering import YawGain, YawRateGain


class Parameters(NamedTuple):
    """K of u = -K [phi, phi', x, x'] as printed, and the gains of the heading."""

    tilt_gain: TiltGain = 44.617
    rate_gain: RateGain = 4.7724
    position_gain: PositionGain = -10.0
    velocity_gain: VelocityGain = -5.2005
    yaw_gain: YawGain = 3.0
    yaw_rate_gain: YawRateGain = 0.3


CONTROLLER = replace(
    RIGHT,
    name="lqr_sun2014_printed",
    historical=True,
    title="Linear-quadratic regulator of Sun 2014, gains as printed.",
    source="Sun 2014 (section V)",
    parameters=Parameters,
)
