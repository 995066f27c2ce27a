"""Kalman filter with the process noise q1 dt as printed: "Kalman" of Table 2.

Laddach 2022 (26)-(31). q1 is the variance of a gyro reading, so q1 dt is no variance of an
angle: the filter weights the accelerometer far too much. It is here to reproduce Table 2;
`kalman` is the right form.
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
    """Noise of the printed Kalman filter; the defaults are those of Table 2."""

    q1: Annotated[
        float,
        Bounds(
            0.0,
            1e2,
            "rad^2/s",
            "Multiplied by dt it is the process noise of the tilt. Larger follows the "
            "accelerometer faster.",
            logarithmic=True,
        ),
    ] = 3.27768e-6
    q2: BiasNoise = 0.0
    r: MeasurementVariance = 8.50492e-6
    first_tilt_gain: FirstTiltGain = 0.00185
    first_bias_gain: FirstBiasGain = -0.00018


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Take one sample with Q = diag(q1 dt, q2), (29) as printed."""
    return advance(state, sample, parameters.q1 * sample.dt, parameters.q2, parameters.r)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (27) with the steady-state gain."""
    return steady_state_matrices(parameters.q1 * dt, parameters.q2, parameters.r, dt)


FILTER = Filter(
    name="kalman_printed",
    historical=True,
    title='Kalman filter with q1 dt as printed, "Kalman" of Table 2.',
    source="Laddach 2022 (26)-(31)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
)
