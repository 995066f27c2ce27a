"""Simplified Kalman filter: constant tilt gain, gyro drift held.

Sun 2014 (26)-(27). The gain on the drift, K2, is set to zero there, so the drift g_e stays
as handed over: 0 on samples that are free of the calibrated bias. The noise w_g of the
printed (26) is unknown to a filter and left out. Sun tunes the integration time T apart
from the sampling period; here that is the ratio `gyro_gain` = T / dt. With a ratio of 1 and
no drift this is the recursion of `complementary` at one sampling period.
"""

from typing import Annotated, NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter


class Parameters(NamedTuple):
    """Settings of the simplified Kalman filter; the defaults suit 1 s at 2 ms."""

    gain: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "1",
            "K1, weight of the angle. Larger follows the accelerometer faster and passes more "
            "of its noise.",
            logarithmic=True,
        ),
    ] = 0.002
    gyro_gain: Annotated[
        float,
        Bounds(
            0.5,
            2.0,
            "1",
            "T / dt, factor on the integrated gyro. Above 1 makes up for a gyro that reads low.",
        ),
    ] = 1.0


class State(NamedTuple):
    """Tilt [rad], tilt rate [rad/s] and the gyro drift that is held [rad/s]."""

    tilt: float
    rate: float
    gyro_bias: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`, its gyro bias included."""
    return State(estimate.tilt, estimate.rate, estimate.gyro_bias)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Integrate the gyro (26), correct with the angle (27)."""
    rate = sample.gyro_y - state.gyro_bias
    predicted = state.tilt + parameters.gyro_gain * sample.dt * rate  # (26)
    tilt = predicted + parameters.gain * (sample.angle - predicted)  # (27)
    return State(tilt, rate, state.gyro_bias)


FILTER = Filter(
    name="kalman_simplified",
    historical=True,
    title="Simplified Kalman filter with a constant gain.",
    source="Sun 2014 (26)-(27)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    tuned_dt=0.002,
)
