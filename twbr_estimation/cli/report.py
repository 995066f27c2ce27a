"""`twbr report BAG... -o DIR`: one HTML page about recordings and estimators, and pictures."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.progress import Progress

from ..disk.writing import write_text
from ..drives.drive import chosen
from ..drives.request import RunRequest
from ..errors import ConfigurationError
from ..many.jobs import WHOLE
from ..many.places import recordings_at
from ..many.reporting import PAGE, Reporting, index_page, title_of
from ..printing.console import SafeConsole
from ..printing.text import say
from ..report.data import collect
from ..report.page import render
from ..report.pictures import tilt_picture
from ..report.traces import traces_of
from .arguments import add_request, finish_compiling, request_of
from .many import add_many, carried_out, is_single, print_failures

TOGETHER = 8
"""Recordings on one page, at most."""


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "report",
        description="Write report.html, which opens without a network, and tilt.png (tilt_2.png "
        f"and so on for further recordings) for slides. More than {TOGETHER} recordings, or those "
        "that other processes do, have a page each, in folders beside report.html, which lists "
        "them.",
    )
    add_request(parser, many=True)
    add_many(parser)
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write to"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing report")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Collect, render, and write; nothing is written before all of it is there."""
    request = request_of(arguments)
    places = recordings_at(arguments.bags)
    by_others = not is_single(arguments, places[:1])
    if len(places) > TOGETHER or by_others:
        return _run_many(arguments, request, places)
    pictures = _pictures(arguments.output, len(places))
    page = arguments.output / PAGE
    _refuse_existing([page, *pictures], arguments.overwrite)
    console = SafeConsole(stderr=True)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("", total=2 * len(places) + 1)
        reports = []
        for bag in map(Path, places):
            progress.update(task, description=f"running {escape(str(bag))}")
            reports.append(collect(request.runs(bag, reference=False)))
            progress.advance(task)
        progress.update(task, description="rendering the page")
        traces = traces_of(reports)
        text = render(reports, traces, shlex.join(["twbr", *sys.argv[1:]]), request.options)
        progress.advance(task)
        write_text(page, text)
        for report, lines, picture in zip(reports, traces, pictures, strict=True):
            progress.update(task, description=f"drawing {escape(str(picture))}")
            tilt_picture(lines, title_of(report), picture)
            progress.advance(task)
    finish_compiling(request, console)
    for path in (page, *pictures):
        size = path.stat().st_size / 1e6
        say(f"{path} ({size:.1f} MB)")
    return 0


def _run_many(arguments: argparse.Namespace, request: RunRequest, places: Sequence[str]) -> int:
    """Have a page written for each recording, then the page that lists them."""
    index = arguments.output / PAGE
    _refuse_existing([index], arguments.overwrite)
    command = shlex.join(["twbr", *sys.argv[1:]])
    job = Reporting(request, arguments.output.resolve(), command)
    with carried_out(arguments, job, places, chosen(request.names)) as done:
        results = {place: done.results(number) for number, place in enumerate(places)}
    pages = {place: each[WHOLE] for place, each in results.items() if WHOLE in each}
    failures = done.failures()
    write_text(index, index_page(pages, failures, command))
    say(f"{index} ({len(pages)} pages)")
    return print_failures(SafeConsole(stderr=True), failures)


def _pictures(folder: Path, count: int) -> list[Path]:
    return [folder / ("tilt.png" if i == 1 else f"tilt_{i}.png") for i in range(1, count + 1)]


def _refuse_existing(paths: Sequence[Path], overwrite: bool) -> None:
    for path in paths:
        if path.exists() and not overwrite:
            raise ConfigurationError(f"{path}: exists already; --overwrite replaces it")
