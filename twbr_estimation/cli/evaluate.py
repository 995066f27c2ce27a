"""`twbr evaluate BAG...`: every filter's error against the reference encoder, as a table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from ..drives import Runs
from ..drives.saving import save_with_reference
from ..errors import ConfigurationError
from ..scoring.errors import RecordingScore
from ..scoring.table import print_scores, write_scores
from .arguments import RunRequest, add_request, finish_compiling, in_flags, request_of


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "evaluate",
        description="Run filters on recordings and compare them with the reference encoder.",
    )
    add_request(parser)
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.add_argument(
        "--save-reference",
        type=Path,
        metavar="DIR",
        help="with --smooth and one recording: write it once more, with the smoothed tilt as its "
        "reference",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate, print the tables and write the JSON."""
    request = request_of(arguments)
    target = _target(arguments)
    runs = _evaluated(arguments.bags, request)
    scores = [_in_flags(each.score) for each in runs if each.score is not None]
    quiet = arguments.json == "-"
    console = Console(stderr=quiet)
    print_scores(console, scores)
    if arguments.json is not None:
        write_scores(arguments.json, scores)
    if target is not None:
        save_with_reference(target, runs[0], arguments.bags[0])
        console.print(f"wrote {escape(str(target))}", soft_wrap=True)
    finish_compiling(request, Console(stderr=True))
    return 0


def _in_flags(score: RecordingScore) -> RecordingScore:
    """Return the score with warnings that name flags."""
    return replace(score, warnings=[in_flags(warning) for warning in score.warnings])


def _target(arguments: argparse.Namespace) -> Path | None:
    """Return where to write the recording with its reference; known before the work."""
    target: Path | None = arguments.save_reference
    if target is None:
        return None
    if not arguments.smooth or len(arguments.bags) != 1:
        raise ConfigurationError("--save-reference: needs --smooth and a single recording")
    if target.exists():
        raise ConfigurationError(f"--save-reference {target}: exists already")
    return target


def _evaluated(bags: Sequence[Path], request: RunRequest) -> list[Runs]:
    runs = []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("evaluating", total=len(bags))
        for count, bag in enumerate(bags):
            progress.update(task, description=f"evaluating {escape(str(bag))}")

            def smoothed(share: float, done: int = count) -> None:
                progress.update(task, completed=done + share)

            def compiled(loops: int, total: int, bag: Path = bag) -> None:
                text = f"compiling {loops} of {total} filters" if loops < total else "evaluating"
                progress.update(task, description=f"{text} {escape(str(bag))}")

            runs.append(request.runs(bag, reference=True, progress=smoothed, compiling=compiled))
            progress.update(task, completed=count + 1)
    return runs
