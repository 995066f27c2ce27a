"""One verb on many recordings: where they are, who works on them, how far it is."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar

from ..errors import ConfigurationError
from ..printing.console import SafeConsole
from ..scoring.table import write_json
from .arguments import in_flags

if TYPE_CHECKING:  # what one recording does not need is imported where it is used
    from ..filters import Filter
    from ..many.jobs import Job
    from ..many.results import ResultTable
    from ..many.series import Failure, Progress, Report, Series
    from ..workers import Workers

SMALL = 8_000_000
"""Recordings of less in all [bytes] are done in this process where `--jobs` says nothing."""
BYTES_A_SAMPLE = 100
SHOWN = 20
"""Lines of failures that are printed."""
PAUSE = 30.0
"""Time between two lines about progress where there is no terminal [s]."""


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add who does the work."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", type=int, metavar="N", help="local processes; default: one a processor"
    )
    where.add_argument(
        "--dask", metavar="ADDRESS", help="scheduler of a Dask cluster, which checks no passwords"
    )


def add_many(parser: argparse.ArgumentParser) -> None:
    """Add who works on many recordings and where results are kept."""
    add_workers(parser)
    parser.add_argument(
        "--results",
        type=Path,
        metavar="FILE.jsonl",
        help="table of results that grows: what it holds is not computed again; default: one in "
        "your cache folder, for several recordings",
    )


@contextmanager
def workers_of(
    arguments: argparse.Namespace, default: int | None = None, module: str = ""
) -> Iterator[Workers]:
    """Give the workers that the arguments of `add_workers` name.

    Processes of this machine begin to import `module` at once.
    """
    if arguments.dask is not None:
        from ..workers.dask_cluster import DaskCluster

        cluster = DaskCluster(arguments.dask)
        try:
            yield cluster
        finally:
            cluster.close()
        return
    jobs = arguments.jobs if arguments.jobs is not None else default or _processors()
    if jobs < 1:
        raise ConfigurationError(f"--jobs {jobs}: at least 1 is needed")
    from ..workers import ThisProcess
    from ..workers.local_pool import LocalPool

    yield ThisProcess() if jobs == 1 else LocalPool(jobs, module)


def _processors() -> int:
    return len(os.sched_getaffinity(0))


def is_single(arguments: argparse.Namespace, places: Sequence[str]) -> bool:
    """Return whether there is one recording on this machine and no word about workers."""
    from ..many.places import is_address

    given = (arguments.jobs, arguments.dask, arguments.results)
    return len(places) == 1 and not is_address(places[0]) and given == (None, None, None)


@contextmanager
def carried_out(
    arguments: argparse.Namespace, job: Job, places: Sequence[str], entries: Iterable[Filter] = ()
) -> Iterator[Series]:
    """Do a job with recordings, and give its results while the table of results is open.

    Args:
        arguments: of `add_many`: workers and table.
        job: what is done.
        places: the recordings.
        entries: filters whose loops are compiled first, where that pays.

    Raises:
        KeyboardInterrupt: Ctrl-C; a line says what is kept.
    """
    from ..many.results import open_table

    with closing(open_table(arguments.results)) as table:
        yield _carried_out(arguments, job, places, table, list(entries))


def _carried_out(
    arguments: argparse.Namespace,
    job: Job,
    places: Sequence[str],
    table: ResultTable,
    entries: Sequence[Filter],
) -> Series:
    from ..batch.running import COMPILE_AFTER
    from ..many.digests import size_of
    from ..many.series import run

    console = SafeConsole(stderr=True)
    size = sum(map(size_of, places))

    def prepare() -> None:
        if entries and arguments.dask is None and size > COMPILE_AFTER * BYTES_A_SAMPLE:
            _compile(console, entries)

    try:
        with (
            workers_of(arguments, 1 if size < SMALL else None) as workers,
            _shown(console, job.verb) as report,
        ):
            return run(job, places, workers, table, report, prepare)
    except KeyboardInterrupt:
        console.print(
            f"interrupted; the results so far are in {escape(str(table.path))}, and the same "
            "command continues from there",
            highlight=False,
            soft_wrap=True,
        )
        raise


def _compile(console: Console, entries: Sequence[Filter]) -> None:
    from ..batch.precompile import compile_missing

    with Bar(console=console, transient=True) as bar:
        task = bar.add_task("compiling the filters")
        compile_missing(entries, lambda done, total: bar.update(task, completed=done, total=total))


@contextmanager
def _shown(console: Console, verb: str) -> Iterator[Report]:
    """Show how far the work is: a bar on a terminal, else a line from time to time."""
    columns = (TextColumn("{task.description}"), BarColumn())
    latest = time.monotonic()
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task(verb)

        def report(progress: Progress) -> None:
            nonlocal latest
            text = f"{verb}: {describe(progress)}"
            bar.update(task, description=text, completed=progress.done, total=progress.recordings)
            if not console.is_terminal and time.monotonic() - latest > PAUSE:
                latest = time.monotonic()
                console.print(text, highlight=False, soft_wrap=True)

        yield report


def describe(progress: Progress) -> str:
    """Return how far the work is, as a line."""
    parts = [f"{progress.done} of {progress.recordings} recordings"]
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    if progress.remaining is not None:
        left = timedelta(seconds=round(progress.remaining))
        parts.append(f"{progress.rate:.3g} a second, {left} left")
    return ", ".join(parts)


def print_failures(console: Console, failures: Sequence[Failure]) -> int:
    """Print what failed and why; return the exit status: 1 where something did."""
    for failure in failures[:SHOWN]:
        console.print(f"failed: {escape(in_flags(str(failure)))}", highlight=False, soft_wrap=True)
    if len(failures) > SHOWN:
        console.print(f"failed: {len(failures) - SHOWN} more")
    return 1 if failures else 0


def write_figures(
    arguments: argparse.Namespace, document: Mapping[str, Any], failures: Sequence[Failure]
) -> None:
    """Write a JSON document where `--json` asks for it, with what failed."""
    failed = [{"source": each.place, "reason": str(each)} for each in failures]
    if arguments.json is not None:
        write_json(arguments.json, {**document, "failed": failed} if failed else document)
