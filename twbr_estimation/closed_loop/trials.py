"""Many trials over the cores, and their joint statistics."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass

import numpy as np

from ..processes import end_with_parent, interrupts_held
from .trial import Outcome, Trial, run

_LOOK = 0.2
"""Between two looks for finished trials [s]."""


@dataclass(frozen=True, slots=True)
class Standings:
    """The mean over the seeds of one world, estimator and controller."""

    world: str
    estimator: str
    controller: str
    seeds: int
    stood: int
    """Seeds without a fall."""
    mean: Mapping[str, float]
    """Mean of each figure of `Outcome`."""


def run_all(
    trials: Sequence[Trial], report: Callable[[int], None], jobs: int | None = None
) -> list[Outcome]:
    """Run trials side by side; the results do not depend on how many.

    Args:
        trials: what to run.
        report: called with the number of trials done.
        jobs: processes; one a core where None.

    Returns:
        The outcomes in the order of the trials.
    """
    jobs = min(jobs or os.cpu_count() or 1, len(trials))
    if jobs <= 1:
        outcomes = []
        for trial in trials:
            outcomes.append(run(trial))
            report(len(outcomes))
        return outcomes
    # The first compiles for all of them.
    found: dict[int, Outcome] = {0: run(trials[0])}
    report(1)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    with ProcessPoolExecutor(jobs, context, end_with_parent) as pool:
        try:
            with interrupts_held():
                begun = [pool.submit(os.getpid) for _ in range(jobs)]
                numbers = {pool.submit(run, trials[i]): i for i in range(1, len(trials))}
                wait(begun)  # a process that is left while it starts would print a traceback
            pending = set(numbers)
            while pending:
                finished, pending = wait(pending, _LOOK, FIRST_COMPLETED)
                found.update({numbers[future]: future.result() for future in finished})
                report(len(found))
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
    return [found[i] for i in range(len(trials))]


def standings(trials: Sequence[Trial], outcomes: Sequence[Outcome]) -> list[Standings]:
    """Return the mean over the seeds, in the order in which the combinations came."""
    groups: dict[tuple[str, str, str], list[Outcome]] = {}
    for trial, outcome in zip(trials, outcomes, strict=True):
        place = trial.world if trial.scene is None else f"{trial.world}, scene {trial.scene}"
        key = (place, trial.estimator, trial.controller)
        groups.setdefault(key, []).append(outcome)
    return [
        Standings(
            *key,
            seeds=len(group),
            stood=sum(outcome.falls == 0 for outcome in group),
            mean=_mean(group),
        )
        for key, group in groups.items()
    ]


def _mean(outcomes: Sequence[Outcome]) -> dict[str, float]:
    rows = [asdict(outcome) for outcome in outcomes]
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def as_json(trials: Sequence[Trial], outcomes: Sequence[Outcome], source: str) -> dict[str, object]:
    """Return the means and every single run; SI units and radians."""
    runs = [
        {
            "world": trial.world,
            **({} if trial.scene is None else {"scene": trial.scene}),
            "estimator": trial.estimator,
            "controller": trial.controller,
            "seed": trial.seed,
            **asdict(outcome),
        }
        for trial, outcome in zip(trials, outcomes, strict=True)
    ]
    return {
        "settings": source,
        "duration": trials[0].duration,
        "dt": trials[0].dt,
        "pushes": trials[0].pushes,
        "standings": [asdict(entry) for entry in standings(trials, outcomes)],
        "runs": runs,
    }
