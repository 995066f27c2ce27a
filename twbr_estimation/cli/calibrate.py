"""`twbr calibrate still|poses|geometry BAG`: the robot's own constants from recordings."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..bags import read_recording
from ..calibration.balance import calibrate_balance
from ..calibration.faces import calibrate_faces
from ..calibration.findings import (
    CalibrationFinding,
    Findings,
    geometry_findings,
    poses_findings,
    still_findings,
)
from ..calibration.geometry import calibrate_geometry
from ..calibration.poses import calibrate_poses
from ..calibration.still import StillOptions, calibrate_still
from ..calibration.turns import calibrate_turns
from ..calibration.wall import calibrate_wall
from ..calibration.warmup import calibrate_warmup
from ..configuration.calibration_files import save
from ..configuration.files import FILES, date_of_now, read_setup
from ..configuration.of_recording import CONFIG_FOLDER
from ..drives import Drive
from ..errors import ConfigurationError
from ..printing.console import SafeConsole
from ..recording import Recording
from ..robot import Setup
from ..scoring.table import write_json
from .arguments import add_recordings, topic_names

Calibrate = Callable[[Sequence[Recording], Setup, argparse.Namespace], Findings]


def add_parser(subparsers: Any) -> None:
    """Add the verb, its own verbs and their arguments."""
    parser = subparsers.add_parser(
        "calibrate",
        description="Estimate what the configuration files hold, each with its standard error.",
    )
    kinds = parser.add_subparsers(title="what to calibrate", metavar="KIND", required=True)
    still = _add_kind(kinds, "still", "biases and noise from a robot at rest", _still)
    still.add_argument(
        "--tilt", type=float, metavar="DEG", help="tilt of the robot; default: the reference, or 0"
    )
    still.add_argument(
        "--tilt-uncertainty",
        type=float,
        default=0.1,
        metavar="DEG",
        help="how well that and the mounting are known; default: %(default)s",
    )
    still.add_argument(
        "--window", type=float, metavar="S", help="length of the windows the drift is shown over"
    )
    _add_kind(
        kinds,
        "poses",
        "accelerometer scale from a robot held at angles",
        lambda drives, setup, _: poses_findings(calibrate_poses(drives[0], setup), setup),
    )
    summary = "lever arm, wheel radius, mounting, gyro scale and delays from drives"
    geometry = _add_kind(kinds, "geometry", summary, _geometry, "+")
    geometry.add_argument(
        "--smooth",
        action="store_true",
        help="make a reference from the recording itself where it has none",
    )
    summary = "accelerometer bias and scale from a robot put on three to six faces"
    _add_kind(kinds, "faces", summary, lambda drives, setup, _: calibrate_faces(drives, setup), "+")
    summary = "gyro scale from whole turns by hand between two rests"
    turns = _add_kind(
        kinds,
        "turns",
        summary,
        lambda drives, setup, given: calibrate_turns(drives, setup, given.turns),
        "+",
    )
    turns.add_argument(
        "--turns", type=float, metavar="N", help="turns made; default: the nearest whole number"
    )
    summary = "mounting pitch from a robot leant against a wall, forward and backward"
    _add_kind(kinds, "wall", summary, lambda drives, setup, _: calibrate_wall(drives, setup), "+")
    summary = "the tilt at which the robot balances, from balancing"
    _add_kind(
        kinds, "balance", summary, lambda drives, setup, _: calibrate_balance(drives, setup), "+"
    )
    summary = "gyro bias against temperature, from a robot at rest that warms up"
    _add_kind(kinds, "warmup", summary, lambda drives, setup, _: calibrate_warmup(drives[0], setup))


def _add_kind(
    kinds: Any, name: str, summary: str, calibrate: Calibrate, count: int | str = 1
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = kinds.add_parser(name, help=summary, description=summary)
    add_recordings(parser, count)
    group = parser.add_argument_group("configuration")
    group.add_argument(
        "--config",
        type=Path,
        metavar="DIR",
        help="folder to start from; default: the output folder, else the one in the recording",
    )
    group.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder to write")
    group.add_argument("--overwrite", action="store_true", help="replace files that exist")
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.set_defaults(run=run, kind=name, calibrate=calibrate)
    return parser


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, print what was found, and write it."""
    console = SafeConsole(stderr=arguments.json == "-")
    start = _start(arguments)
    setup = Setup() if start is None else read_setup(start)
    radius = setup.robot.wheel_radius
    recordings = [
        read_recording(bag, topic_names(arguments)).with_wheel_angles(radius)
        for bag in arguments.bags
    ]
    findings = arguments.calibrate(recordings, setup, arguments)
    console.print(_table(recordings, findings))
    remarks = [f"{each.name}: {each.note}" for each in findings.quantities if each.note]
    for remark in (*remarks, *findings.notes):
        console.print(escape(remark), highlight=False, soft_wrap=True)
    origin = _origin(recordings)
    if arguments.json is not None:
        document = {"estimates": findings.estimates(), **findings.figures, "provenance": origin}
        write_json(arguments.json, document)
    _write(arguments, console, start, findings, origin)
    return 0


def _start(arguments: argparse.Namespace) -> Path | None:
    """Return the configuration folder to start from, if there is any."""
    if arguments.config is not None:
        if not arguments.config.is_dir():
            raise ConfigurationError(f"{arguments.config}: there is no such configuration folder")
        return Path(arguments.config)
    candidates = [arguments.output, arguments.bags[0] / CONFIG_FOLDER]
    for folder in candidates:
        if folder is not None and any((folder / name).is_file() for name in FILES):
            return Path(folder)
    return None


def _write(
    arguments: argparse.Namespace,
    console: Console,
    start: Path | None,
    findings: Findings,
    origin: dict[str, Any],
) -> None:
    console.print(escape(f"started from {start or 'the defaults'}"), soft_wrap=True)
    if arguments.output is None:
        console.print("nothing written: no -o DIR", highlight=False)
        return
    provenance = {**origin, **findings.provenance}
    done = save(
        arguments.output, start, findings.setup, arguments.kind, provenance, arguments.overwrite
    )
    for sentence in done:
        console.print(escape(sentence), highlight=False, soft_wrap=True)


def _origin(recordings: Sequence[Recording]) -> dict[str, Any]:
    """Return where the values come from."""
    origin: dict[str, Any] = {
        "source": ", ".join(recording.source for recording in recordings),
        "date": date_of_now(),
        "duration": round(sum(recording.duration for recording in recordings), 6),
    }
    measured = [each.temperature for each in recordings if each.temperature is not None]
    if measured:
        means = [float(track.temperature.mean()) for track in measured]
        origin["temperature"] = sum(means) / len(means)
    return origin


def _table(recordings: Sequence[Recording], findings: Findings) -> Table:
    title = ", ".join(f"{each.source} ({each.duration:.1f} s)" for each in recordings)
    table = Table(title=escape(title), title_justify="left")
    table.add_column("quantity", no_wrap=True)
    for heading in ("before", "found", "standard error"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for each in findings.quantities:
        found = _shown(each, each.value) if each.value is not None else "not known"
        cells = (_shown(each, each.before), found, _shown(each, each.error))
        table.add_row(each.name, *cells, each.unit.shown)
    return table


def _shown(finding: CalibrationFinding, value: float | None) -> str:
    if value is None or not math.isfinite(value):
        return ""
    return f"{value * finding.unit.factor:.4g}"


def _still(
    recordings: Sequence[Recording], setup: Setup, arguments: argparse.Namespace
) -> Findings:
    tilt = None if arguments.tilt is None else math.radians(arguments.tilt)
    options = StillOptions(tilt, math.radians(arguments.tilt_uncertainty), arguments.window)
    return still_findings(calibrate_still(recordings[0], setup, options), setup)


def _geometry(
    recordings: Sequence[Recording], setup: Setup, arguments: argparse.Namespace
) -> Findings:
    smoothed = arguments.smooth and any(each.reference is None for each in recordings)
    if smoothed:
        recordings = [_smoothed(recording, setup) for recording in recordings]
    return geometry_findings(calibrate_geometry(recordings, setup, smoothed), setup)


def _smoothed(recording: Recording, setup: Setup) -> Recording:
    """Return a recording with its smoothed tilt as reference where it has none."""
    if recording.reference is not None:
        return recording
    drive = Drive(recording, setup)
    return drive.with_reference(drive.smoothed().as_track()).recording
