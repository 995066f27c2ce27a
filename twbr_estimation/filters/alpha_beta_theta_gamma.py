"""Alpha-beta-theta-gamma filter: both residuals correct both states.

Laddach 2022 (38)-(40), in the form of the journal; the 2023 text swaps the two residuals in
the rate's equation, which diverges. With the printed gains of 2, 5 and 10 ms gamma is next
to 0: the tracked rate hardly moves, theta is a gain on the gyro, and the rate at which the
tilt really advances is that of the first equation of (39). That one is reported as `rate`.
"""

from typing import Annotated, NamedTuple

import numpy as np

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter, Matrices
from .gains import AngleGain


class Parameters(NamedTuple):
    """Gains of the alpha-beta-theta-gamma filter."""

    alpha: AngleGain = 0.00204
    beta: Annotated[
        float,
        Bounds(
            -1.0,
            1.0,
            "1",
            "Gain of the angle residual, over dt, on the tracked rate. Larger in modulus "
            "moves the tracked rate more with every error of the accelerometer.",
        ),
    ] = -0.00001
    theta: Annotated[
        float,
        Bounds(
            -1.0,
            3.0,
            "1",
            "Gain of the rate residual, times dt, on the tilt. With gamma near 0 it is a gain "
            "on the gyro: above 1 makes up for a gyro that reads low.",
        ),
    ] = 1.07026
    gamma: Annotated[
        float,
        Bounds(
            -1.0,
            2.0,
            "1",
            "Gain of the rate residual on the tracked rate. 0 ignores the gyro there, 1 takes "
            "it as it is, above 1 looks ahead.",
        ),
    ] = -0.00013


class State(NamedTuple):
    """Tilt [rad], the rate at which it advances [rad/s] and the tracked rate [rad/s]."""

    tilt: float
    rate: float
    tracked_rate: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`.

    The tracked rate starts at that share of the estimate's rate which a step of gain gamma
    would take over from rest. Section 4 of the paper starts it at the gyro reading; with
    gamma near 0 a hand-over in motion would then keep that rate for seconds.
    """
    share = min(max(parameters.gamma, 0.0), 1.0)
    return State(estimate.tilt, estimate.rate, share * estimate.rate)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict at the tracked rate (38), correct both states with both residuals (39)."""
    dt = sample.dt
    predicted = state.tilt + dt * state.tracked_rate  # (38)
    angle_residual = sample.angle - predicted
    rate_residual = sample.gyro_y - state.tracked_rate
    tilt = predicted + parameters.alpha * angle_residual + parameters.theta * dt * rate_residual
    tracked_rate = (
        state.tracked_rate
        + parameters.beta / dt * angle_residual
        + parameters.gamma * rate_residual
    )  # (39)
    return State(tilt, state.tracked_rate + parameters.theta * rate_residual, tracked_rate)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (40); the states are tilt and tracked rate."""
    return Matrices(
        a=np.array([[1.0, dt], [0.0, 1.0]]),
        b=np.zeros((2, 0)),
        c=np.eye(2),
        k=np.array(
            [[parameters.alpha, parameters.theta * dt], [parameters.beta / dt, parameters.gamma]]
        ),
    )


FILTER = Filter(
    name="alpha_beta_theta_gamma",
    title="Alpha-beta-theta-gamma filter: both residuals on both states.",
    source="Laddach 2022 (38)-(40)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
