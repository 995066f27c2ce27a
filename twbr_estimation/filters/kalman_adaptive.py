"""Adaptive Kalman filter: the variance of the angle follows its own innovations.

The outlook of Laddach 2022 suggests it: the corrected angle is good while the robot stands and poor
in an impact, and one r cannot be both. The mean square of the innovations over the last moments
estimates C P C^T + R, and what P does not explain is R (Mehra 1970, covariance matching; Mohamed
and Schwarz 1999 for navigation). The present innovation is part of the mean, so a shock gets a
small weight in the sample in which it occurs. Tilt and bias are those of Laddach 2022 (26)-(31).
"""

import math
from typing import Annotated, NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from . import kalman_recursion
from .base import Bounds, Filter
from .gains import BiasDrift, FirstBias, FirstTilt
from .kalman_recursion import advance


class Parameters(NamedTuple):
    """Noise of the gyro and memory of the adaptation; independent of the sampling period."""

    rate_noise: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "rad/sqrt(s)",
            "Random walk of the integrated gyro: its noise and what an unknown gain adds while "
            "the robot swings. Larger follows the accelerometer faster.",
            logarithmic=True,
        ),
    ] = math.radians(0.4)
    bias_drift: BiasDrift = 1e-4
    bias: FirstBias = math.radians(0.3)
    first_tilt: FirstTilt = math.radians(1.0)
    angle_noise: Annotated[
        float,
        Bounds(
            1e-4,
            3.0,
            "rad",
            "Standard deviation of the angle that the adaptation starts from.",
            logarithmic=True,
            tunable=False,
        ),
    ] = math.radians(8.0)
    memory: Annotated[
        float,
        Bounds(
            1e-3,
            1e3,
            "s",
            "Time over which the squares of the innovations are averaged. Shorter weights a "
            "resting robot's angle sooner and gives each shock less weight.",
            logarithmic=True,
        ),
    ] = 0.05


class State(NamedTuple):
    """The estimate, the recursion behind it, and the mean square of the innovations."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    recursion: kalman_recursion.State
    innovation_square: float
    """Estimate of P_11 + R [rad^2]."""


def _state(recursion: kalman_recursion.State, innovation_square: float) -> State:
    return State(
        recursion.tilt,
        recursion.rate,
        recursion.gyro_bias,
        recursion.tilt_variance,
        recursion,
        innovation_square,
    )


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    recursion = kalman_recursion.State(
        estimate.tilt,
        estimate.rate,
        estimate.gyro_bias,
        parameters.first_tilt * parameters.first_tilt,
        0.0,
        parameters.bias * parameters.bias,
        sample.gyro_y,
        0.0,
    )
    return _state(recursion, parameters.angle_noise * parameters.angle_noise)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Match R to the innovations, not below the variance of the sensor, then take one sample."""
    before, dt = state.recursion, sample.dt
    innovation = sample.angle - before.tilt - dt * (before.gyro - before.gyro_bias)
    weight = dt / (parameters.memory + dt)
    square = state.innovation_square
    square += weight * (innovation * innovation - square)
    angle_variance = max(square - before.tilt_variance, sample.angle_variance)
    tilt_noise = parameters.rate_noise * parameters.rate_noise * dt
    bias_noise = parameters.bias_drift * parameters.bias_drift * dt
    return _state(advance(before, sample, tilt_noise, bias_noise, angle_variance), square)


FILTER = Filter(
    name="kalman_adaptive",
    title="Kalman filter that learns the variance of the angle from its innovations.",
    source="Laddach 2022, outlook; Mehra 1970; Mohamed 1999",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
)
