"""Classical alpha-beta filter: tilt and rate from the angle alone, the gyro unused.

Laddach 2022 (32)-(33) as the text has them, which is the textbook alpha-beta (g-h) filter
of a position sensor. The comparison shows the benefit of the gyro.
"""

from typing import Annotated, NamedTuple

import numpy as np

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter, Matrices
from .gains import AngleGain


class Parameters(NamedTuple):
    """Gains of the classical alpha-beta filter; the defaults are critically damped in 0.1 s."""

    alpha: AngleGain = 0.0392
    beta: Annotated[
        float,
        Bounds(
            0.0,
            4.0,
            "1",
            "Gain of the angle residual, over dt, on the rate. Larger follows turns faster; "
            "far above alpha^2 / (2 - alpha) it rings.",
        ),
    ] = 0.000392


class State(NamedTuple):
    """Tilt [rad] and tilt rate [rad/s]."""

    tilt: float
    rate: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    return State(estimate.tilt, estimate.rate)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict at constant rate (32), correct both states with the angle (33)."""
    predicted = state.tilt + state.rate * sample.dt  # (32)
    residual = sample.angle - predicted
    tilt = predicted + parameters.alpha * residual
    rate = state.rate + parameters.beta / sample.dt * residual  # (33)
    return State(tilt, rate)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices that belong to (33); the only output is the angle."""
    return Matrices(
        a=np.array([[1.0, dt], [0.0, 1.0]]),
        b=np.zeros((2, 0)),
        c=np.array([[1.0, 0.0]]),
        k=np.array([[parameters.alpha], [parameters.beta / dt]]),
    )


FILTER = Filter(
    name="alpha_beta_classic",
    historical=True,
    title="Classical alpha-beta filter on the angle alone.",
    source="Laddach 2022 (32)-(33)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
