"""Kalman filter whose process noise is given for one sample: "Kalman*" of Table 2.

Laddach 2022 (26)-(31) with Q = diag(q1, q2): only without dt do the printed values of
Kalman* give the printed errors. The complementary Kalman filter of Sihite 2018 (2), (39)
and the Kalman filter of Chudzik 2021 (3)-(10) are this filter.
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
    """Noise of the tuned Kalman filter.

    The defaults are those of Table 2 at 2 ms but for q2, printed as 0: at that a bias learned
    from a wrong start stays for minutes. The default makes the gain on the bias settle near
    that of `alpha_beta_wb`.
    """

    q1: Annotated[
        float,
        Bounds(
            0.0,
            1e2,
            "rad^2",
            "Variance added to the tilt in one sample. Larger follows the accelerometer faster.",
            logarithmic=True,
        ),
    ] = 3.04617e-9
    q2: BiasNoise = 2.3e-11
    r: MeasurementVariance = 7.02570e-4
    first_tilt_gain: FirstTiltGain = 0.00185
    first_bias_gain: FirstBiasGain = -0.00018


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Take one sample with Q = diag(q1, q2)."""
    return advance(state, sample, parameters.q1, parameters.q2, parameters.r)


def matrices(parameters: Parameters, dt: float) -> Matrices:
    """Return the matrices of (27) with the steady-state gain."""
    return steady_state_matrices(parameters.q1, parameters.q2, parameters.r, dt)


FILTER = Filter(
    name="kalman_tuned",
    title='Kalman filter with noise per sample, "Kalman*" of Table 2.',
    source="Laddach 2022 (26)-(31), Kalman*; Sihite 2018 (2), (39); Chudzik 2021 (3)-(10)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    matrices=matrices,
    tuned_dt=0.002,
)
