"""`twbr check BAG...`: whether sensors, wheels, units, signs, axes and clocks are right."""

from __future__ import annotations

import argparse
from typing import Any

from rich.console import Console

from ..checks.finding import Finding, Severity, worst
from ..checks.suitability import suitability
from ..checks.table import as_json, print_findings
from ..drives import Drive, load
from ..scoring.table import write_json
from .arguments import add_recordings, add_settings, topic_names


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "check",
        help="whether sensors, wheels, units, signs, axes and clocks are right",
        description="The acceptance test of a robot: drive it by hand or let it balance for a "
        "minute, with some seconds at rest. Exit status 1 if anything FAILs, else 0.",
    )
    add_recordings(parser)
    add_settings(parser)
    parser.add_argument("--json", metavar="FILE", help="also write the findings; - for stdout")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check, print a table for each recording, and return 1 where something fails."""
    console = Console(stderr=arguments.json == "-")
    found: dict[str, list[Finding]] = {}
    for bag in arguments.bags:
        drive = load(
            bag,
            config=arguments.config,
            preset=arguments.preset,
            topics=topic_names(arguments),
        )
        found[str(bag)] = _findings(drive)
        _print(console, drive, found[str(bag)])
    if arguments.json is not None:
        write_json(arguments.json, {"recordings": [_document(*each) for each in found.items()]})
    everything = [finding for findings in found.values() for finding in findings]
    return 1 if worst(everything) is Severity.FAIL else 0


def _findings(drive: Drive) -> list[Finding]:
    repairs = [
        Finding(Severity.WARN, "bag", "repair", f"repaired: {repair}: {count}")
        for repair, count in drive.recording.repairs.items()
    ]
    notes = [Finding(Severity.WARN, "robot", "description", note) for note in drive.notes]
    found = [*notes, *repairs, *drive.findings]
    return [*found, *suitability(drive.recording, found)]


def _print(console: Console, drive: Drive, findings: list[Finding]) -> None:
    recording = drive.recording
    title = f"{drive.source}: {recording.imu.stamps.size} samples, {recording.duration:.1f} s"
    print_findings(console, title, findings)


def _document(source: str, findings: list[Finding]) -> dict[str, Any]:
    return {"source": source, "worst": worst(findings).name, "findings": as_json(findings)}
