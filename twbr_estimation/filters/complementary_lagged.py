"""Complementary filter on the previous sample, the gyro unweighted.

Sihite 2018 (1), (36)-(37). Unlike `complementary` it takes gyro and angle one sample late
and multiplies the old tilt alone by its weight c = exp(-sigma dt).
"""

import math
from typing import Annotated, NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter


class Parameters(NamedTuple):
    """Settings of the lagged complementary filter; the default is the paper's."""

    cutoff: Annotated[
        float,
        Bounds(
            1e-3,
            1e3,
            "rad/s",
            "Crossover frequency sigma. Larger follows the accelerometer faster and passes "
            "more of its noise.",
            logarithmic=True,
        ),
    ] = 4.0


class State(NamedTuple):
    """Tilt [rad], tilt rate [rad/s] and the angle one sample ago [rad]."""

    tilt: float
    rate: float
    angle: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    return State(estimate.tilt, estimate.rate, sample.angle)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Blend the previous gyro and the previous angle (1)."""
    weight = math.exp(-parameters.cutoff * sample.dt)
    tilt = weight * state.tilt + state.rate * sample.dt + (1.0 - weight) * state.angle  # (1)
    return State(tilt, sample.gyro_y, sample.angle)


FILTER = Filter(
    name="complementary_lagged",
    historical=True,
    title="Complementary filter on the previous sample.",
    source="Sihite 2018 (1), (36)-(37)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
)
