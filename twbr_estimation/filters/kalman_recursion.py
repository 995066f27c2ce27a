"""The recursion behind every two-state Kalman filter of the papers: tilt and gyro bias.

Laddach 2022 (26)-(31), Sihite 2018 (2) and Chudzik 2021 (3)-(10) describe the same filter;
they differ in the process noise alone, which the filter files pass. The covariance is
predicted with A P A^T: (28) prints A^-1, with which the bias would never be learned.
"""

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Matrices

BiasNoise = Annotated[
    float,
    Bounds(
        0.0,
        1.0,
        "(rad/s)^2",
        "Variance by which the gyro bias may wander in one sample, q2 of (29). 0 stops learning "
        "the bias after a while; larger learns it faster and less smoothly.",
        logarithmic=True,
    ),
]
MeasurementVariance = Annotated[
    float,
    Bounds(
        1e-12,
        1e3,
        "rad^2",
        "Variance of the corrected angle, r of (30). Larger follows the gyro longer. Only its "
        "ratio to q1 and q2 shapes the tilt, so a tuner leaves it alone.",
        logarithmic=True,
        tunable=False,
    ),
]
FirstTiltGain = Annotated[
    float,
    Bounds(
        1e-6,
        0.999,
        "1",
        "Gain of the very first angle residual on the tilt, from which the initial covariance "
        "follows: alpha of alpha_beta_wb in the paper.",
        tunable=False,
    ),
]
FirstBiasGain = Annotated[
    float,
    Bounds(
        -1.0,
        1.0,
        "1/s",
        "Gain of the very first angle residual on the gyro bias: beta of alpha_beta_wb in the "
        "paper; negative learns the bias.",
        tunable=False,
    ),
]


class State(NamedTuple):
    """Estimate, covariance and what the next prediction needs."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    """P_11 [rad^2]."""
    covariance: float
    """P_12 = P_21 [rad^2/s]."""
    bias_variance: float
    """P_22 [(rad/s)^2]."""
    gyro: float
    """The gyro reading one sample ago [rad/s]."""
    is_fresh: float
    """1 straight after a reset, when the covariance already is that of the next prediction."""


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Any) -> State:
    """Continue from `estimate` with the covariance that makes the first gains the given ones.

    From (30): P(1|0)_11 = k1 r / (1 - k1) and P(1|0)_12 = k2 r / (1 - k1). P_22 is free from
    P_12^2 / P_11 on; twice that keeps P safely a covariance under rounding. The rule sets
    P(1|0) rather than P(0|0): the latter would need a negative variance where the process
    noise of one sample exceeds P(1|0)_11.
    """
    first_tilt_gain, first_bias_gain = parameters.first_tilt_gain, parameters.first_bias_gain
    scale = parameters.r / (1.0 - first_tilt_gain)
    return State(
        estimate.tilt,
        estimate.rate,
        estimate.gyro_bias,
        first_tilt_gain * scale,
        first_bias_gain * scale,
        2.0 * first_bias_gain * first_bias_gain * scale / first_tilt_gain,
        sample.gyro_y,
        1.0,
    )


def advance(
    state: State,
    sample: CorrectedSample,
    tilt_noise: float,
    bias_noise: float,
    measurement_variance: float,
) -> State:
    """Take one sample: predict (26)-(28), gain (30), correct (31).

    Args:
        state: after the previous sample.
        sample: the new sample; its dt is above 0.
        tilt_noise: Q_11, variance added to the tilt over this sample [rad^2].
        bias_noise: Q_22, variance added to the gyro bias over this sample [(rad/s)^2].
        measurement_variance: R, variance of the angle [rad^2], above 0.
    """
    dt = sample.dt
    p11, p12, p22 = state.tilt_variance, state.covariance, state.bias_variance
    if state.is_fresh == 0.0:
        p11 = p11 + dt * (dt * p22 - 2.0 * p12) + tilt_noise  # (28) with A P A^T
        p12 = p12 - dt * p22
        p22 = p22 + bias_noise
    predicted = state.tilt + dt * (state.gyro - state.gyro_bias)  # (26)
    innovation_variance = p11 + measurement_variance
    k1 = p11 / innovation_variance  # (30)
    k2 = p12 / innovation_variance
    residual = sample.angle - predicted
    bias = state.gyro_bias + k2 * residual  # (31)
    return State(
        predicted + k1 * residual,
        sample.gyro_y - bias,
        bias,
        (1.0 - k1) * p11,
        (1.0 - k1) * p12,
        p22 - k2 * p12,
        sample.gyro_y,
        0.0,
    )


def steady_state_matrices(
    tilt_noise: float, bias_noise: float, measurement_variance: float, dt: float
) -> Matrices:
    """Return the matrices of (27) with the gain that the recursion settles at.

    The Riccati equation of this model has a closed form. With S = P_11 + r and z = sqrt(S)
    its three scalars reduce to w^2 - dt sqrt(q) w - (4 r + Q_11) = 0 for w = z + r / z, where
    q = Q_22; then K = [1 - r / S, -sqrt(q) / z].
    """
    drift = dt * math.sqrt(bias_noise)
    w = 0.5 * (drift + math.sqrt(drift**2 + 4.0 * (4.0 * measurement_variance + tilt_noise)))
    z = 0.5 * (w + math.sqrt(max(w * w - 4.0 * measurement_variance, 0.0)))
    return Matrices(
        a=np.array([[1.0, -dt], [0.0, 1.0]]),
        b=np.array([[dt], [0.0]]),
        c=np.array([[1.0, 0.0]]),
        k=np.array([[1.0 - measurement_variance / z**2], [-math.sqrt(bias_noise) / z]]),
    )
