"""`twbr check BAG...`: whether sensors, wheels, units, signs, axes and clocks are right."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from ..checks.finding import Severity, worst
from ..checks.table import from_json, print_findings
from ..many.checking import Checking
from ..many.jobs import WHOLE
from ..many.places import recordings_at
from ..many.series import Failure
from ..printing.console import SafeConsole
from ..printing.text import counted
from .arguments import add_recordings, add_settings, topic_names
from .frames import add_frames, frames_of
from .many import add_many, carried_out, is_single, print_failures, write_figures


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "check",
        help="whether sensors, wheels, units, signs, axes and clocks are right",
        description="The acceptance test of a robot: drive it by hand or let it balance for a "
        "minute, with some seconds at rest. Exit status 1 if anything FAILs or "
        "a recording cannot be read, else 0.",
    )
    add_recordings(parser, many=True)
    add_settings(parser)
    add_frames(parser, recorded=True)
    add_many(parser)
    parser.add_argument("--json", metavar="FILE", help="also write the findings; - for stdout")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check, print a table for each recording, and return 1 where something fails."""
    places = recordings_at(arguments.bags)
    console = SafeConsole(stderr=arguments.json == "-")
    frames = frames_of(arguments)
    job = Checking(topic_names(arguments), arguments.config, arguments.preset, frames)
    failures: Sequence[Failure] = ()
    if is_single(arguments, places):
        path = Path(places[0])
        found = {places[0]: job.run(job.open(places[0], path), WHOLE)}
    else:
        with carried_out(arguments, job, places) as done:
            results = [done.results(number) for number in range(len(places))]
        failures = done.failures()
        found = {
            place: result[WHOLE]
            for place, result in zip(places, results, strict=True)
            if WHOLE in result
        }
    for place, result in found.items():
        _print(console, place, result)
    write_figures(arguments, {"recordings": [_document(*each) for each in found.items()]}, failures)
    severities = [worst(from_json(result["findings"])) for result in found.values()]
    status = print_failures(SafeConsole(stderr=True), failures)
    return 1 if Severity.FAIL in severities else status


def _print(console: Console, source: str, result: Mapping[str, Any]) -> None:
    title = f"{source}: {counted(result['samples'], 'sample')}, {result['duration_s']:.1f} s"
    print_findings(console, title, from_json(result["findings"]))


def _document(source: str, result: Mapping[str, Any]) -> dict[str, Any]:
    severity = worst(from_json(result["findings"]))
    return {"source": source, "worst": severity.name, "findings": result["findings"]}
