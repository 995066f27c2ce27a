"""Alpha-beta filter without gyro bias: tilt and rate, each corrected by its own sensor.

Laddach 2022 (32), (34). The text form (33) corrects the rate with the angle residual; the
matrices (34) correct it with the rate residual, and only they reproduce the printed gains
and errors. The text form is the filter `alpha_beta_classic`.
"""

from typing import NamedTuple

import numpy as np

from ..samples import CorrectedSample, TiltEstimate
from .base import Filter, Matrices
from .gains import AngleGain, RateGain


class Parameters(NamedTuple):
    """Gains of the alpha-beta filter without bias."""

    alpha: AngleGain = 0.00227
    beta: RateGain = 1.58242


class State(NamedTuple):
    """Tilt [rad] and tilt rate [rad/s]."""

    tilt: float
    rate: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    return State(estimate.tilt, estimate.rate)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict at constant rate (32), correct each state with its own sensor (34)."""
    predicted = state.tilt + state.rate * sample.dt  # (32)
    tilt = predicted + parameters.alpha * (sample.angle - predicted)
    rate = state.rate + parameters.beta * (sample.gyro_y - state.rate)  # (34)
    return State(tilt, rate)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (34); the outputs are angle and gyro."""
    return Matrices(
        a=np.array([[1.0, dt], [0.0, 1.0]]),
        b=np.zeros((2, 0)),
        c=np.eye(2),
        k=np.array([[parameters.alpha, 0.0], [0.0, parameters.beta]]),
    )


FILTER = Filter(
    name="alpha_beta_wob",
    title="Alpha-beta filter without gyro bias.",
    source="Laddach 2022 (32), (34)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
