"""`twbr evaluate BAG...`: every filter's error against the reference encoder, as a table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from ..evaluation import RecordingScore
from ..offline import Request, evaluate
from ..scores import print_scores, write_scores
from .arguments import add_request, request_of


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "evaluate",
        help="errors of every filter against the reference encoder",
        description="Run filters on recordings and compare them with the reference encoder.",
    )
    add_request(parser)
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate, print the tables and write the JSON."""
    request = request_of(arguments)
    scores = _evaluated(arguments.bags, request)
    quiet = arguments.json == "-"
    console = Console(stderr=quiet)
    print_scores(console, scores)
    if arguments.json is not None:
        write_scores(arguments.json, scores)
    return 0


def _evaluated(bags: Sequence[Path], request: Request) -> list[RecordingScore]:
    scores = []
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("evaluating", total=len(bags))
        for bag in bags:
            progress.update(
                task, description=f"evaluating {escape(str(bag))} (the first run compiles)"
            )
            scores.append(evaluate(bag, request))
            progress.advance(task)
    return scores
