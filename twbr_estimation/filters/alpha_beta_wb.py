"""Alpha-beta filter with gyro bias: the gyro drives the prediction, the angle corrects it.

Laddach 2022 (35)-(37). The samples are already free of the calibrated bias, so the bias
estimated here starts at zero: it is the remainder after calibration.
"""

from typing import Annotated, NamedTuple

import numpy as np

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter, Matrices
from .gains import AngleGain


class Parameters(NamedTuple):
    """Gains of the alpha-beta filter with bias."""

    alpha: AngleGain = 0.00185
    beta: Annotated[
        float,
        Bounds(
            -1.0,
            1.0,
            "1/s",
            "Gain of the angle residual on the gyro bias; negative "
            "learns the bias. Larger in modulus learns faster and less smoothly.",
        ),
    ] = -0.00018


class State(NamedTuple):
    """Tilt [rad], tilt rate [rad/s], gyro bias [rad/s] and the gyro one sample ago."""

    tilt: float
    rate: float
    gyro_bias: float
    gyro: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    return State(estimate.tilt, estimate.rate, estimate.gyro_bias, sample.gyro_y)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict with the previous gyro reading (35), correct with the angle (36)."""
    predicted = state.tilt + (state.gyro - state.gyro_bias) * sample.dt  # (35)
    residual = sample.angle - predicted
    bias = state.gyro_bias + parameters.beta * residual  # (36)
    tilt = predicted + parameters.alpha * residual  # (36)
    return State(tilt, sample.gyro_y - bias, bias, sample.gyro_y)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (37)."""
    return Matrices(
        a=np.array([[1.0, -dt], [0.0, 1.0]]),
        b=np.array([[dt], [0.0]]),
        c=np.array([[1.0, 0.0]]),
        k=np.array([[parameters.alpha], [parameters.beta]]),
    )


FILTER = Filter(
    name="alpha_beta_wb",
    title="Alpha-beta filter with gyro bias.",
    source="Laddach 2022 (35)-(37)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
