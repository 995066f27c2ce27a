"""Workers that are processes of this machine."""

from __future__ import annotations

import multiprocessing
import queue
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from itertools import islice
from multiprocessing import forkserver
from typing import Any

from ..errors import WorkerError
from ..processes import end_with_parent, interrupts_held
from .base import Outcomes, Report, UnitResult, Work

ATTEMPTS = 3
"""Processes that may die of one unit before it counts as lost."""
_LOOK = 0.1  # [s] between two looks at what workers report
_WAITING = 2  # units a process, one at work and one ready


class LocalPool:
    """Does several units at once in processes of this machine."""

    def __init__(self, jobs: int, module: str = "") -> None:
        """Get ready.

        Args:
            jobs: how many processes.
            module: the one that holds the work; where given, it is imported at once, while the
                work is prepared.
        """
        self._jobs = jobs
        # Processes are forked from a clean one: this one may have threads.
        self._context = multiprocessing.get_context("forkserver")
        if module:
            self._import(module)

    def _import(self, module: str) -> None:
        """Have a module imported where processes are forked from; a second one changes nothing."""
        self._context.set_forkserver_preload([module])
        with interrupts_held():
            forkserver.ensure_running()

    def run(self, work: Work, units: Iterable[Any], report: Report) -> Outcomes:
        """As `Workers`; a process that dies costs its unit's time, no result."""
        source = iter(units)
        while True:
            suspects: list[Any] = []
            yield from self._attempt(work, source, self._jobs, report, suspects)
            if not suspects:
                return
            for unit in suspects:  # alone, the one that kills its process is known
                yield from self._alone(work, unit, report)

    def _alone(self, work: Work, unit: Any, report: Report) -> Outcomes:
        for _ in range(ATTEMPTS - 1):
            suspects: list[Any] = []
            yield from self._attempt(work, iter([unit]), 1, report, suspects)
            if not suspects:
                return
        yield UnitResult(unit, lost=f"its process died {ATTEMPTS} times; out of memory?")

    def _attempt(
        self, work: Work, source: Iterator[Any], jobs: int, report: Report, suspects: list[Any]
    ) -> Outcomes:
        """Yield what is done until nothing is left, or a process dies with `suspects` under way."""
        first = next(source, _END)
        if first is _END:
            return
        self._import(work.function.__module__)
        with interrupts_held():
            reports, stop = self._context.Queue(), self._context.Event()
        with ProcessPoolExecutor(jobs, self._context, _begin, (work, reports, stop)) as pool:
            pending: dict[Future[Any], Any] = {}
            try:
                suspects += _submitted(pool, [first], pending)
                while not suspects:
                    ready = list(islice(source, _WAITING * jobs - len(pending)))
                    suspects += _submitted(pool, ready, pending)
                    if not pending:
                        return
                    finished, _ = wait(pending, _LOOK, FIRST_COMPLETED)
                    _drain(reports, report)
                    with closing(_results(finished, pending, suspects)) as results:
                        yield from results
                suspects += pending.values()
            finally:
                stop.set()
                pool.shutdown(wait=True, cancel_futures=True)
                _drain(reports, report)


_END = object()


def _submitted(
    pool: ProcessPoolExecutor, units: list[Any], pending: dict[Future[Any], Any]
) -> list[Any]:
    """Hand units to the pool; return those that a broken one did not take."""
    for index, unit in enumerate(units):
        try:
            with interrupts_held():  # which starts processes
                pending[pool.submit(_unit, unit)] = unit
        except BrokenProcessPool:
            return units[index:]
    return []


def _results(
    finished: Iterable[Future[Any]], pending: dict[Future[Any], Any], suspects: list[Any]
) -> Outcomes:
    for future in finished:
        unit = pending.pop(future)
        if isinstance(future.exception(), BrokenProcessPool):
            suspects.append(unit)
        else:
            yield UnitResult(unit, future.result())


def _drain(reports: Any, report: Report) -> None:
    while True:
        try:
            report(reports.get_nowait())
        except queue.Empty:
            return


class _WorkerState:
    """State of a worker process, set up when it begins."""

    work: Work
    channel: _ProcessChannel


class _ProcessChannel:
    def __init__(self, reports: Any, stop: Any) -> None:
        self.send = reports.put
        self._stop = stop

    def require_wanted(self) -> None:
        if self._stop.is_set():
            raise WorkerError("stopped on request")


def _begin(work: Work, reports: Any, stop: Any) -> None:
    end_with_parent()
    reports.cancel_join_thread()  # unread reports must not keep the process
    _WorkerState.work, _WorkerState.channel = work, _ProcessChannel(reports, stop)


def _unit(unit: Any) -> Any:
    return _WorkerState.work.function(_WorkerState.work.shared, unit, _WorkerState.channel)
