"""Extended Kalman filter for tilt, gyro bias and gyro gain.

The outlook of Laddach 2022: a gyro that reads a few percent low turns every swing into an error
of the tilt. Here the gain is a third state, learned from the corrected angle while the robot
swings: tilt' = (1 + gain) gyro - bias. The product of state and input makes the filter an
extended one, with A = [1, -dt, dt gyro; 0, 1, 0; 0, 0, 1] in Laddach 2022 (26)-(31). The
covariance is corrected in Joseph's form, so that it stays one.
"""

# The products of the 3 x 3 matrices are written out: with the array operations of
# `model_based.covariance` a live step takes ten times the processor time, and rounds otherwise.

import math
from typing import Annotated, NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter
from .gains import BiasDrift, FirstBias, FirstTilt


class Parameters(NamedTuple):
    """Noise of gyro and angle; independent of the sampling period but for `angle_noise`."""

    rate_noise: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "rad/sqrt(s)",
            "Random walk of the integrated gyro. Larger follows the accelerometer faster.",
            logarithmic=True,
        ),
    ] = math.radians(1.0)
    bias_drift: BiasDrift = 1e-3
    gain_drift: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "1/sqrt(s)",
            "Wandering of the gyro gain. Larger learns it faster and less smoothly.",
            logarithmic=True,
        ),
    ] = 1e-4
    bias: FirstBias = math.radians(0.3)
    gain: Annotated[
        float,
        Bounds(0.0, 0.5, "1", "Standard deviation of the relative gain error, at the start."),
    ] = 0.03
    first_tilt: FirstTilt = math.radians(1.0)
    angle_noise: Annotated[
        float,
        Bounds(
            1e-4,
            3.0,
            "rad",
            "Standard deviation of the corrected angle in motion, larger than its rms because its "
            "errors last. Larger follows the gyro longer.",
            logarithmic=True,
        ),
    ] = math.radians(20.0)


class State(NamedTuple):
    """Estimate and covariance."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    gyro_gain: float
    """Gain error: the gyro reading is multiplied by 1 plus this."""
    tilt_bias: float
    """Covariance of tilt and bias [rad^2/s]."""
    tilt_gain: float
    """Covariance of tilt and gain [rad]."""
    bias_variance: float
    bias_gain: float
    """Covariance of bias and gain [rad/s]."""
    gain_variance: float
    gyro: float
    """The gyro reading one sample ago [rad/s]."""


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`; the gain is not known yet."""
    return State(
        estimate.tilt,
        estimate.rate,
        estimate.gyro_bias,
        parameters.first_tilt * parameters.first_tilt,
        0.0,
        0.0,
        0.0,
        parameters.bias * parameters.bias,
        0.0,
        parameters.gain * parameters.gain,
        sample.gyro_y,
    )


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Predict with the mean of two gyro readings, then correct with the angle."""
    prior = _predicted(state, 0.5 * (state.gyro + sample.gyro_y), sample.dt, parameters)
    noise = max(parameters.angle_noise * parameters.angle_noise, sample.angle_variance)
    return _corrected(prior, sample, noise)


def _predicted(state: State, gyro: float, dt: float, parameters: Parameters) -> State:
    """Return the state before the angle is seen, with P = A P A^T + Q."""
    turn = dt * gyro
    p11, p12, p13 = state.tilt_variance, state.tilt_bias, state.tilt_gain
    p22, p23, p33 = state.bias_variance, state.bias_gain, state.gain_variance
    tilt_bias = p12 - dt * p22 + turn * p23
    tilt_gain = p13 - dt * p23 + turn * p33
    return State(
        state.tilt + (1.0 + state.gyro_gain) * turn - dt * state.gyro_bias,
        state.rate,
        state.gyro_bias,
        p11
        - dt * (p12 + tilt_bias)
        + turn * (p13 + tilt_gain)
        + parameters.rate_noise * parameters.rate_noise * dt,
        state.gyro_gain,
        tilt_bias,
        tilt_gain,
        p22 + parameters.bias_drift * parameters.bias_drift * dt,
        p23,
        p33 + parameters.gain_drift * parameters.gain_drift * dt,
        state.gyro,
    )


def _corrected(prior: State, sample: CorrectedSample, noise: float) -> State:
    """Return the state with the angle, whose variance is `noise`."""
    p11, p12, p13 = prior.tilt_variance, prior.tilt_bias, prior.tilt_gain
    total = p11 + noise
    k1, k2, k3 = p11 / total, p12 / total, p13 / total
    residual, left = sample.angle - prior.tilt, 1.0 - k1
    bias = prior.gyro_bias + k2 * residual
    gain = prior.gyro_gain + k3 * residual
    return State(
        prior.tilt + k1 * residual,
        (1.0 + gain) * sample.gyro_y - bias,
        bias,
        left * left * p11 + k1 * k1 * noise,
        gain,
        left * (p12 - k2 * p11) + k1 * k2 * noise,
        left * (p13 - k3 * p11) + k1 * k3 * noise,
        prior.bias_variance - 2.0 * k2 * p12 + k2 * k2 * total,
        prior.bias_gain - k2 * p13 - k3 * p12 + k2 * k3 * total,
        prior.gain_variance - 2.0 * k3 * p13 + k3 * k3 * total,
        sample.gyro_y,
    )


FILTER = Filter(
    name="kalman_extended",
    title="Extended Kalman filter for tilt, gyro bias and gyro gain.",
    source="Laddach 2022, outlook",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
)
