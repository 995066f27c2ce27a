"""`twbr report BAG... -o DIR`: one HTML page about recordings and estimators, and pictures."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from ..disk.writing import write_text
from ..errors import ConfigurationError
from ..report.data import RecordingReport, collect
from ..report.page import render
from ..report.pictures import tilt_picture
from ..report.traces import styles_of, traces_of
from .arguments import add_request, finish_compiling, request_of

PAGE = "report.html"


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "report",
        description="Write report.html, which opens without a network, and tilt.png (tilt_2.png "
        "and so on for further recordings) for slides.",
    )
    add_request(parser)
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write to"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing report")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Collect, render, and write; nothing is written before all of it is there."""
    request = request_of(arguments)
    pictures = _pictures(arguments.output, len(arguments.bags))
    page = arguments.output / PAGE
    _refuse_existing([page, *pictures], arguments.overwrite)
    console = Console(stderr=True)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("", total=2 * len(arguments.bags) + 1)
        reports = []
        for bag in arguments.bags:
            progress.update(task, description=f"running {escape(str(bag))}")
            reports.append(collect(request.runs(bag, reference=False)))
            progress.advance(task)
        progress.update(task, description="rendering the page")
        text = render(reports, shlex.join(["twbr", *sys.argv[1:]]), request.options)
        progress.advance(task)
        write_text(page, text)
        for report, picture in zip(reports, pictures, strict=True):
            progress.update(task, description=f"drawing {escape(str(picture))}")
            traces = traces_of(report, styles_of(reports))
            tilt_picture(traces, _title(report), picture)
            progress.advance(task)
    finish_compiling(request, console)
    for path in (page, *pictures):
        size = path.stat().st_size / 1e6
        print(f"{path} ({size:.1f} MB)")
    return 0


def _title(report: RecordingReport) -> str:
    """Return the title of a picture; a smoothed reference must not look like an encoder."""
    source = report.runs.recording.source
    smoothed = report.reference.startswith("smoothed")
    return f"{source}; reference: {report.reference}" if smoothed else source


def _pictures(folder: Path, count: int) -> list[Path]:
    return [folder / ("tilt.png" if i == 1 else f"tilt_{i}.png") for i in range(1, count + 1)]


def _refuse_existing(paths: Sequence[Path], overwrite: bool) -> None:
    for path in paths:
        if path.exists() and not overwrite:
            raise ConfigurationError(f"{path}: exists already; --overwrite replaces it")
