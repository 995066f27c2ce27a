"""The drives of the simulated rig on which the experiments are done again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..configuration.presets import preset
from ..drives import Drive
from ..simulation import World, simulate
from ..simulation.worlds import PAPER
from ..tuning.objective import TuningSet, prepare

TRAINING_SEEDS = (101, 102, 103, 104, 105)
"""Drives to tune on; none of them is reported."""
LARGEST_SEEDS = 100
"""Reported seeds are 1, 2, ...; more would reach the training seeds."""
DURATION = 60.0
"""Length of a drive [s]."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Worlds, seeds and repetitions of an experiment."""

    seeds: int = 5
    """Number of drives that are reported."""
    world: World = PAPER
    duration: float = DURATION

    def training(self, dt: float) -> list[TuningSet]:
        """Return the drives to tune on."""
        return drives(self.world, dt, TRAINING_SEEDS, self.duration)

    def reported(self, dt: float) -> list[TuningSet]:
        """Return the drives that figures are reported of."""
        return drives(self.world, dt, range(1, self.seeds + 1), self.duration)


def drives(world: World, dt: float, seeds: Sequence[int], duration: float) -> list[TuningSet]:
    """Return drives, corrected with Table 1's time constants for `dt`."""
    correction, _ = preset("table2", dt)
    sets = []
    for seed in seeds:
        made = simulate(world, dt, duration, seed)
        setup = made.setup if correction is None else replace(made.setup, correction=correction)
        sets.append(prepare(Drive(made.recording, setup)))
    return sets


def raw_mse(sets: Sequence[TuningSet]) -> float:
    """Return the MSE of the plain arctangent of the readings, as in Table 1 [deg^2]."""
    figures = []
    for each in sets:
        forward, up = (each.samples.field(f"accel_{axis}") for axis in "xz")
        with np.errstate(divide="ignore"):
            error = each.errors(np.arctan(-forward / up))
        figures.append(float(np.mean(np.square(np.degrees(error)))))
    return float(np.mean(figures))
