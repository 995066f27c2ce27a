"""Several filters tuned at once: a unit of work is one filter on all the training recordings.

Each unit reports the best values so far, so that an interrupted run loses nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing

from ..errors import WorkerError
from ..filters.base import filter_named
from ..workers import Channel, ThisProcess, Work, Workers
from .filter import TunedFilter, TuningTask, judged, tune_filter
from .search import tunable

Report = Callable[[str, float, Mapping[str, float]], None]
"""Takes a filter's name, its best figure so far and the values that belong to it."""
WORTH_REPORTING = 0.999
"""A figure is reported when it is below this times the last one reported."""


def tune_filters(
    task: TuningTask, names: Sequence[str], workers: Workers, report: Report
) -> list[TunedFilter]:
    """Tune several filters; after Ctrl-C the best so far counts, marked as interrupted.

    Args:
        task: recordings and objective.
        names: of the filters.
        workers: who does it.
        report: called with what improves.

    Returns:
        The filters in the order of `names`; after Ctrl-C those that were begun.

    Raises:
        WorkerError: workers die again and again.
    """
    best: dict[str, Mapping[str, float]] = {}
    done: dict[str, TunedFilter] = {}

    def note(improvement: tuple[str, float, Mapping[str, float]]) -> None:
        name, figure, values = improvement
        best[name] = dict(values)
        report(name, figure, values)

    try:
        ordered = names if isinstance(workers, ThisProcess) else longest_first(names)
        with closing(workers.run(Work(tune_unit, task), ordered, note)) as outcomes:
            for outcome in outcomes:
                if outcome.lost:
                    raise WorkerError(f"{outcome.unit}: {outcome.lost}")
                done[outcome.unit] = outcome.result
    except KeyboardInterrupt:
        for name in best.keys() - done.keys():
            done[name] = judged(task, name, best[name], interrupted=True)
    return [done[name] for name in names if name in done]


def tune_unit(task: TuningTask, name: str, channel: Channel) -> TunedFilter:
    """Tune one filter, on whatever machine."""
    improvements = Improvements(name, channel)
    return tune_filter(task, name, improvements)


class Improvements:
    """Passes the progress of one search on where it is worth it."""

    def __init__(self, name: str, channel: Channel) -> None:
        """`channel` gets what improves the filter `name`."""
        self._name, self._channel = name, channel
        self._reported = float("inf")

    def __call__(self, figure: float, values: Mapping[str, float]) -> None:
        """Take the best figure so far.

        Raises:
            WorkerError: the search is no longer wanted.
        """
        if figure < WORTH_REPORTING * self._reported:
            self._reported = figure
            self._channel.send((self._name, figure, dict(values)))
        self._channel.require_wanted()


def longest_first(names: Sequence[str]) -> list[str]:
    """Return the names in the order that keeps all workers busy to the end."""
    return sorted(names, key=lambda name: len(tunable(filter_named(name))), reverse=True)
