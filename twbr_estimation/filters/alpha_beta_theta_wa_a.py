"""Alpha-beta-theta filter with angular acceleration learned from the angle residual.

Laddach 2022 (41)-(43), variant iv.a, in the form of the journal; the 2023 text writes other
left-hand sides. With theta = 0, as printed for all sampling periods, the acceleration stays
as it started and the filter is `alpha_beta_wob`.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter, Matrices
from .gains import AngleGain, RateGain


class Parameters(NamedTuple):
    """Gains of the alpha-beta-theta filter, variant a."""

    alpha: AngleGain = 0.00169
    beta: RateGain = 1.21567
    theta: Annotated[
        float,
        Bounds(
            -1.0,
            2.0,
            "1",
            "Gain of the angle residual, over dt^2, on the acceleration. 0 leaves the "
            "acceleration alone; larger passes accelerometer noise into the rate.",
        ),
    ] = 0.0


class State(NamedTuple):
    """Tilt [rad], tilt rate [rad/s] and angular acceleration [rad/s^2]."""

    tilt: float
    rate: float
    acceleration: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate` with no acceleration."""
    return State(estimate.tilt, estimate.rate, 0.0)


def predict(state: State, dt: float) -> State:
    """Move on by `dt` at constant acceleration (41)."""
    return State(
        state.tilt + dt * state.rate + 0.5 * dt * dt * state.acceleration,
        state.rate + dt * state.acceleration,
        state.acceleration,
    )


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict (41), correct each state, the acceleration with the angle (42)."""
    predicted = predict(state, sample.dt)
    angle_residual = sample.angle - predicted.tilt
    return State(
        predicted.tilt + parameters.alpha * angle_residual,
        predicted.rate + parameters.beta * (sample.gyro_y - predicted.rate),
        predicted.acceleration + parameters.theta / (sample.dt * sample.dt) * angle_residual,
    )  # (42)


def matrices_with(gain: NDArray[np.float64], dt: float) -> Matrices:
    """Return the matrices of (43) with the gain K of either variant, (3, 2)."""
    return Matrices(
        a=np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]]),
        b=np.zeros((3, 0)),
        c=np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        k=gain,
    )


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (43), variant iv.a."""
    alpha, beta, theta = parameters
    return matrices_with(np.array([[alpha, 0.0], [0.0, beta], [theta / dt**2, 0.0]]), dt)


FILTER = Filter(
    name="alpha_beta_theta_wa_a",
    title="Alpha-beta-theta filter, acceleration learned from the angle.",
    source="Laddach 2022 (41)-(43), iv.a",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
