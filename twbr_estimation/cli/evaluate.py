"""`twbr evaluate BAG...`: every filter's error against the reference encoder, as a table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.progress import Progress

from ..drives import Runs
from ..drives.drive import chosen
from ..drives.request import RunRequest
from ..drives.saving import save_with_reference
from ..errors import ConfigurationError
from ..many.places import recordings_at
from ..printing.console import SafeConsole
from ..scoring.score import RecordingScore, as_json
from ..scoring.table import print_many_scores, print_scores, write_scores
from .arguments import add_request, finish_compiling, in_flags, request_of
from .many import add_many, carried_out, is_single, print_failures, write_figures


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "evaluate",
        description="Run filters on recordings and compare them with the reference encoder. A "
        "recording that fails is named and the others are done; the exit status is then 1.",
    )
    add_request(parser, many=True)
    add_many(parser)
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
    places = recordings_at(arguments.bags)
    target = _target(arguments, places)
    if target is None and not is_single(arguments, places):
        return _run_many(arguments, request, places)
    bags = [Path(place) for place in places]
    runs = _evaluated(bags, request)
    scores = [_in_flags(each.score) for each in runs if each.score is not None]
    quiet = arguments.json == "-"
    console = SafeConsole(stderr=quiet)
    print_scores(console, scores)
    if arguments.json is not None:
        write_scores(arguments.json, scores)
    if target is not None:
        save_with_reference(target, runs[0], bags[0])
        console.print(f"wrote {escape(str(target))}", soft_wrap=True)
    finish_compiling(request, SafeConsole(stderr=True))
    return 0


def _run_many(arguments: argparse.Namespace, request: RunRequest, places: Sequence[str]) -> int:
    """Evaluate several recordings, print what there is of them and return the exit status."""
    from ..many.evaluation import Evaluation, merged

    errors, quiet = SafeConsole(stderr=True), arguments.json == "-"
    job = Evaluation.of(request)
    with carried_out(arguments, job, places, chosen(request.names)) as done:
        found = (
            merged(place, request.names, done.results(number))
            for number, place in enumerate(places)
        )
        scores = [_in_flags(score) for score in found if score is not None]
    console, failures = SafeConsole(stderr=quiet), done.failures()
    print_many_scores(console, scores)
    write_figures(arguments, as_json(scores), failures)
    finish_compiling(request, errors)
    return print_failures(errors, failures)


def _in_flags(score: RecordingScore) -> RecordingScore:
    """Return the score with warnings and findings that name flags."""
    findings = [{**each, "text": in_flags(each["text"])} for each in score.findings]
    return replace(score, warnings=[in_flags(each) for each in score.warnings], findings=findings)


def _target(arguments: argparse.Namespace, places: Sequence[str]) -> Path | None:
    """Return where to write the recording with its reference; known before the work."""
    target: Path | None = arguments.save_reference
    if target is None:
        return None
    if not arguments.smooth or len(places) != 1:
        raise ConfigurationError("--save-reference: needs --smooth and a single recording")
    if target.exists():
        raise ConfigurationError(f"--save-reference {target}: exists already")
    return target


def _evaluated(bags: Sequence[Path], request: RunRequest) -> list[Runs]:
    runs = []
    with Progress(console=SafeConsole(stderr=True), transient=True) as progress:
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
