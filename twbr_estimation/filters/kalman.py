"""Kalman filter for tilt and gyro bias, with q1 as a variance of the rate.

Laddach 2022 (26)-(31) with Q_11 = q1 dt^2. (29) prints q1 dt, yet q1 is the variance of a
rate and comes from the noise of the gyro at rest, so dt^2 has the right unit; untuned, this
form is on a par with the tuned filters of the paper.

A saturated gyro does not raise q1: the tilt would then follow the accelerometer during the impact,
where its error is largest; on the simulated rig this multiplied the error.
"""

from typing import Annotated, NamedTuple

from ..samples import CorrectedSample
from .base import Bounds, Filter, Matrices
from .kalman_recursion import (
    BiasNoise,
    FirstBiasGain,
    FirstTiltGain,
    MeasurementVariance,
    State,
    advance,
    reset,
    steady_state_matrices,
)


class Parameters(NamedTuple):
    """Noise of the Kalman filter.

    The defaults are the paper's noise of an MPU6050 but for q2, printed as 0: at that a bias
    learned from a wrong start stays for minutes. The default makes the gain on the bias settle
    near that of `alpha_beta_wb`.
    """

    q1: Annotated[
        float,
        Bounds(
            0.0,
            1e2,
            "(rad/s)^2",
            "Variance of one gyro reading. Larger follows the accelerometer faster.",
            logarithmic=True,
        ),
    ] = 3.27768e-6
    q2: BiasNoise = 2.8e-13
    r: MeasurementVariance = 8.50492e-6
    first_tilt_gain: FirstTiltGain = 0.00185
    first_bias_gain: FirstBiasGain = -0.00018
    use_sample_variance: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "1",
            "1 raises r to the variance that travels with each angle, which grows where the "
            "accelerometer saturates or weighs little; 0 keeps the paper's recursion.",
            tunable=False,
        ),
    ] = 0.0


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Take one sample with Q = diag(q1 dt^2, q2)."""
    tilt_noise = parameters.q1 * sample.dt * sample.dt
    angle_variance = parameters.r
    if parameters.use_sample_variance >= 0.5:
        angle_variance = max(angle_variance, sample.angle_variance)
    return advance(state, sample, tilt_noise, parameters.q2, angle_variance)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (27) with the steady-state gain."""
    return steady_state_matrices(parameters.q1 * dt * dt, parameters.q2, parameters.r, dt)


FILTER = Filter(
    name="kalman",
    title="Kalman filter for tilt and gyro bias, q1 a rate variance.",
    source="Laddach 2022 (26)-(31) with q1 dt^2 in (29)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
)
