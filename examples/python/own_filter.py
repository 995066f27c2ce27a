"""A filter of your own, judged beside the ones of the package, without changing the package.

    python examples/python/own_filter.py bags/verification

A filter is two functions and their records: `reset` begins at an estimate, `step` takes a
sample. Both see the corrected sample; its fields are those of `CorrectedSample`.
"""

from __future__ import annotations

import sys
from typing import Annotated, NamedTuple

import twbr_estimation as twbr


class Parameters(NamedTuple):
    """What a user may set."""

    time_constant: Annotated[
        float, twbr.Bounds(0.01, 100.0, "s", "Above it the angle rules, below it the gyro")
    ] = 2.0


class State(NamedTuple):
    """What a step keeps for the next one."""

    tilt: float
    rate: float


def reset(
    estimate: twbr.TiltEstimate, sample: twbr.CorrectedSample, parameters: Parameters
) -> State:
    """Go on from an estimate."""
    return State(estimate.tilt, estimate.rate)


def step(state: State, sample: twbr.CorrectedSample, parameters: Parameters) -> State:
    """Turn with the gyro, then go towards the accelerometer's angle unless it is saturated."""
    tilt = state.tilt + sample.gyro_y * sample.dt
    if sample.accel_saturated_x + sample.accel_saturated_z == 0.0:
        share = sample.dt / (parameters.time_constant + sample.dt)
        tilt += share * (sample.angle - tilt)
    return State(tilt, sample.gyro_y)


MINE = twbr.Filter(
    name="mine",
    title="Complementary filter that leaves saturated samples out.",
    source="this file",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
)


def main(bag: str) -> None:
    """Print the errors of the filter with two time constants beside those of the package's."""
    drive = twbr.load(bag)
    for time_constant in (0.5, 5.0):
        runs = drive.run(MINE, "complementary", values={"mine": {"time_constant": time_constant}})
        print(f"time constant {time_constant:g} s")
        print(runs.scores())


if __name__ == "__main__":
    main(sys.argv[1])
