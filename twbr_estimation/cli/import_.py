"""`twbr import FILE --format NAME -o BAG`: other logs as recordings."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.markup import escape

from ..bags import require_room
from ..bags.writing import estimator_topic
from ..checks.check import check
from ..checks.finding import noteworthy
from ..imports import ImportOptions, formats, load, write_import
from ..printing.console import SafeConsole
from ..robot import CorrectionSettings, Setup
from .arguments import in_flags
from .frames import add_frames, frames_of


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    lines = (f"  {name:16} {in_flags(module.FORMAT)}" for name, module in formats().items())
    parser = subparsers.add_parser(
        "import",
        description="Turn a log of another kind into a recording with its robot's description.",
        epilog="formats:\n" + "\n".join(lines),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", type=Path, help="log to read")
    parser.add_argument("--format", required=True, choices=list(formats()), help="see below")
    parser.add_argument("--columns", type=Path, metavar="YAML", help="what the columns are (csv)")
    parser.add_argument(
        "--axis",
        choices=("x", "y"),
        default="y",
        help="tilt axis (broad); default: y",
    )
    add_frames(parser, recorded=False)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing recording")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Import, write, and print a summary."""
    require_room(arguments.output, arguments.overwrite)
    options = ImportOptions(arguments.columns, arguments.axis)
    log = load(arguments.file, arguments.format, options)
    if (frames := frames_of(arguments)) is not None:
        log = replace(log, robot=frames.robot(log.robot))
    write_import(arguments.output, log, arguments.overwrite)
    console = SafeConsole()
    recording = log.recording
    tracks = {
        "wheels": recording.wheels,
        "reference": recording.reference,
        "temperature": recording.temperature,
        "motors": recording.motors,
        **recording.estimators,
    }
    there = ", ".join(name for name, track in tracks.items() if track is not None) or "nothing else"
    console.print(
        f"{arguments.output}: {recording.imu.stamps.size} IMU samples at "
        f"{recording.dt * 1e3:.4g} ms, {recording.duration:.1f} s; with {there}",
        highlight=False,
        soft_wrap=True,
    )
    for what in ("time", "monitor"):
        if what in log.provenance:
            console.print(f"  {escape(str(log.provenance[what]))}", highlight=False, soft_wrap=True)
    for name in recording.estimators:
        flag = f"--estimator {name}={estimator_topic(name)}"
        console.print(f"  scored beside ours with {flag}", highlight=False, soft_wrap=True)
    for repair, count in recording.repairs.items():
        console.print(f"  repaired: {escape(repair)}: {count}", highlight=False, soft_wrap=True)
    setup = Setup(log.robot, log.calibration, log.correction or CorrectionSettings())
    for finding in noteworthy(check(recording, setup)):
        console.print(f"warning: {escape(finding.sentence)}", highlight=False, soft_wrap=True)
    return 0
