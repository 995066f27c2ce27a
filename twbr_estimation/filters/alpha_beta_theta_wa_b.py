"""Alpha-beta-theta filter with angular acceleration learned from the rate residual.

Laddach 2022 (41)-(43), variant iv.b, in the form of the journal.
"""

from typing import Annotated, NamedTuple

import numpy as np

from ..samples import CorrectedSample
from .alpha_beta_theta_wa_a import State, matrices_with, predict, reset
from .base import Bounds, Filter, Matrices
from .gains import AngleGain, RateGain


class Parameters(NamedTuple):
    """Gains of the alpha-beta-theta filter, variant b."""

    alpha: AngleGain = 0.00315
    beta: RateGain = 0.28647
    theta: Annotated[
        float,
        Bounds(
            0.0,
            2.0,
            "1",
            "Gain of the rate residual, over dt, on the acceleration. 0 leaves the acceleration "
            "alone; larger follows turns faster and passes more gyro noise.",
        ),
    ] = 0.00673


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict (41), correct each state, the acceleration with the gyro (42)."""
    predicted = predict(state, sample.dt)
    rate_residual = sample.gyro_y - predicted.rate
    return State(
        predicted.tilt + parameters.alpha * (sample.angle - predicted.tilt),
        predicted.rate + parameters.beta * rate_residual,
        predicted.acceleration + parameters.theta / sample.dt * rate_residual,
    )  # (42)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (43), variant iv.b."""
    alpha, beta, theta = parameters
    return matrices_with(np.array([[alpha, 0.0], [0.0, beta], [0.0, theta / dt]]), dt)


FILTER = Filter(
    name="alpha_beta_theta_wa_b",
    title="Alpha-beta-theta filter, acceleration learned from the gyro.",
    source="Laddach 2022 (41)-(43), iv.b",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
