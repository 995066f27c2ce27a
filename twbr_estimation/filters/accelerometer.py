"""Baseline: the corrected angle as it comes, Laddach 2022 (13)."""

from typing import NamedTuple

from ..samples import CorrectedSample, TiltEstimate
from .base import Filter


class Parameters(NamedTuple):
    """The corrected angle has no settings."""


class State(NamedTuple):
    """Tilt [rad], tilt rate [rad/s] and variance of the tilt [rad^2]."""

    tilt: float
    rate: float
    tilt_variance: float


def reset(estimate: TiltEstimate, sample: CorrectedSample, parameters: Parameters) -> State:
    """Report `estimate` until the next sample."""
    return State(estimate.tilt, estimate.rate, sample.angle_variance)


def step(state: State, sample: CorrectedSample, parameters: Parameters) -> State:
    """Report the angle of the sample (13)."""
    return State(sample.angle, sample.gyro_y, sample.angle_variance)


FILTER = Filter(
    name="accelerometer",
    title="Corrected accelerometer angle alone (baseline).",
    source="Laddach 2022 (13)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    limits={"hand_over": "it has no memory: the first sample decides"},
)
