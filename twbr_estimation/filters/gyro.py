"""Baseline: the integrated gyro, Laddach 2022 (44)."""

from typing import NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from .base import Filter


class Parameters(NamedTuple):
    """The integrated gyro has no settings."""


class State(NamedTuple):
    """Tilt [rad] and tilt rate [rad/s]."""

    tilt: float
    rate: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Continue from `estimate`."""
    return State(estimate.tilt, estimate.rate)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Integrate the rate of the current sample (44)."""
    return State(state.tilt + sample.dt * sample.gyro_y, sample.gyro_y)


FILTER = Filter(
    name="gyro",
    title="Integrated gyro alone (baseline).",
    source="Laddach 2022 (44)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    limits={"convergence": "nothing corrects the start or the drift"},
)
