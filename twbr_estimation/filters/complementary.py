"""First-order complementary filter: gyro at high frequencies, accelerometer at low ones.

Laddach 2022 (44)-(50) and Chudzik 2021 (1)-(2) are the same recursion: Chudzik's weight
is a = T_c / (T_c + dt). The gyro enters at the current sample, not the previous one.
"""

from typing import Annotated, NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter


class Parameters(NamedTuple):
    """Settings of the complementary filter."""

    time_constant: Annotated[
        float,
        Bounds(
            1e-3,
            1e3,
            "s",
            "Crossover time constant T_c. Larger follows the gyro longer: less accelerometer "
            "noise, slower recovery from a wrong start and more error from gyro bias.",
            logarithmic=True,
        ),
    ] = 1.0


class State(NamedTuple):
    """Tilt [rad] and tilt rate [rad/s]."""

    tilt: float
    rate: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    return State(estimate.tilt, estimate.rate)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Blend the integrated gyro with the corrected angle, Laddach 2022 (49)."""
    weight = parameters.time_constant / (sample.dt + parameters.time_constant)
    gyro_tilt = state.tilt + sample.dt * sample.gyro_y
    return State(weight * gyro_tilt + (1.0 - weight) * sample.angle, sample.gyro_y)


FILTER = Filter(
    name="complementary",
    title="First-order complementary filter.",
    source="Laddach 2022 (44)-(50); Chudzik 2021 (1)-(2)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
)
