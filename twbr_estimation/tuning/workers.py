"""Workers that tune the filters: this process, a pool of local ones, or a Dask cluster.

A unit of work is one filter on all the training recordings. Each worker reports the best values
so far, so that an interrupted run loses nothing.
"""

from __future__ import annotations

import multiprocessing
import queue
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Protocol

from ..errors import WorkerError
from ..filters.base import filter_named
from ..processes import interrupts_held
from .filter import TunedFilter, TuningTask, judged, tune_filter
from .search import tunable

Report = Callable[[str, float, Mapping[str, float]], None]
"""Takes a filter's name, its best figure so far and the values that belong to it."""
WORTH_REPORTING = 0.999
"""A figure is reported when it is below this times the last one reported."""
_ATTEMPTS = 3  # pools to start before giving up on units whose processes die
_LOOK = 0.1  # [s] between two looks at what workers report


class Workers(Protocol):
    """Anybody who tunes filters."""

    def tune(self, task: TuningTask, names: Sequence[str], report: Report) -> Iterator[TunedFilter]:
        """Yield each filter as it is done, in any order.

        Raises:
            WorkerError: workers die again and again.
        """
        ...


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
    """
    best: dict[str, Mapping[str, float]] = {}
    done: dict[str, TunedFilter] = {}

    def note(name: str, figure: float, values: Mapping[str, float]) -> None:
        best[name] = dict(values)
        report(name, figure, values)

    try:
        for tuned in workers.tune(task, names, note):
            done[tuned.name] = tuned
    except KeyboardInterrupt:
        for name in best.keys() - done.keys():
            done[name] = judged(task, name, best[name], interrupted=True)
    return [done[name] for name in names if name in done]


class Improvements:
    """Passes the progress of one search on where it is worth it."""

    def __init__(self, name: str, report: Report) -> None:
        """`report` gets what improves the filter `name`."""
        self._name, self._report = name, report
        self._reported = float("inf")

    def __call__(self, figure: float, values: Mapping[str, float]) -> None:
        """Take the best figure so far."""
        if figure < WORTH_REPORTING * self._reported:
            self._reported = figure
            self._report(self._name, figure, dict(values))


def longest_first(names: Sequence[str]) -> list[str]:
    """Return the names in the order that keeps all workers busy to the end."""
    return sorted(names, key=lambda name: len(tunable(filter_named(name))), reverse=True)


class ThisProcess:
    """Tunes one filter after the other, here."""

    def tune(self, task: TuningTask, names: Sequence[str], report: Report) -> Iterator[TunedFilter]:
        """As `Workers`."""
        for name in names:
            yield tune_filter(task, name, Improvements(name, report))


class LocalPool:
    """Tunes several filters at once in processes of this machine."""

    def __init__(self, jobs: int) -> None:
        """`jobs`: how many processes."""
        self._jobs = jobs
        # Processes are forked from a clean one: this one may have threads.
        self._context = multiprocessing.get_context("forkserver")

    def tune(self, task: TuningTask, names: Sequence[str], report: Report) -> Iterator[TunedFilter]:
        """As `Workers`; a process that dies costs its unit's time, no result."""
        left = list(names)
        for _ in range(_ATTEMPTS):
            try:
                for tuned in self._attempt(task, tuple(left), report):
                    left.remove(tuned.name)
                    yield tuned
                return
            except BrokenProcessPool:
                continue
        raise WorkerError(
            f"processes died {_ATTEMPTS} times while tuning {', '.join(left)}; out of memory?"
        )

    def _attempt(
        self, task: TuningTask, names: Sequence[str], report: Report
    ) -> Iterator[TunedFilter]:
        self._context.set_forkserver_preload([__name__])
        with interrupts_held():
            reports, stop = self._context.Queue(), self._context.Event()
        with ProcessPoolExecutor(
            min(self._jobs, len(names)), self._context, _begin, (task, reports, stop)
        ) as pool:
            try:
                with interrupts_held():
                    pending = {pool.submit(_unit, name) for name in longest_first(names)}
                while pending:
                    finished, pending = wait(pending, _LOOK, FIRST_COMPLETED)
                    _drain(reports, report)
                    # What is done comes first: a broken pool breaks all others at once.
                    for future in sorted(finished, key=lambda each: each.exception() is not None):
                        yield future.result()
            finally:
                stop.set()
                pool.shutdown(wait=True, cancel_futures=True)
                _drain(reports, report)


def _drain(reports: Any, report: Report) -> None:
    while True:
        try:
            report(*reports.get_nowait())
        except queue.Empty:
            return


class _WorkerState:
    """State of a worker process, set up when it begins."""

    task: TuningTask
    reports: Any
    stop: Any


def _begin(task: TuningTask, reports: Any, stop: Any) -> None:
    reports.cancel_join_thread()  # unread reports must not keep the process
    _WorkerState.task, _WorkerState.reports, _WorkerState.stop = task, reports, stop


def _unit(name: str) -> TunedFilter:
    improvements = Improvements(name, lambda *report: _WorkerState.reports.put(report))

    def watch(figure: float, values: Mapping[str, float]) -> None:
        improvements(figure, values)
        if _WorkerState.stop.is_set():
            raise WorkerError(f"{name}: stopped on request")

    return tune_filter(_WorkerState.task, name, watch)
