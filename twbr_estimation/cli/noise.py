"""`twbr noise BAG...`: spectra, Allan deviation, and how the bias drifts."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from ..errors import ConfigurationError
from ..many.jobs import WHOLE
from ..many.noise_figures import CURVES, NoiseFigures
from ..many.places import local_copy, recordings_at
from ..many.series import Failure
from ..noise import GYRO_UNIT
from ..noise.allan import MARKED_TIMES
from ..noise.spectra import MOTION_SHARE
from ..printing.console import SafeConsole
from ..report.pictures import noise_picture
from .arguments import add_comparison, add_recordings, add_settings, comparison, topic_names
from .many import add_many, carried_out, is_single, print_failures, write_figures


def add_parser(subparsers: Any) -> None:
    """Add the verb and its arguments."""
    parser = subparsers.add_parser(
        "noise",
        description="Measure the noise of the sensors. A recording with a reference gives the "
        "spectra of the angle's error before and after the correction; a robot at rest gives "
        "the gyro's spectrum, Allan deviations and the drift of the bias.",
    )
    add_recordings(parser, many=True)
    add_settings(parser)
    add_many(parser)
    add_comparison(parser)
    parser.add_argument(
        "--window",
        type=float,
        metavar="S",
        help="average the bias over windows of S seconds; default: a twentieth of the rest",
    )
    parser.add_argument("--json", metavar="FILE", help="also write the figures; - for stdout")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="also draw them")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing picture")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Analyse, print the tables, write JSON and picture."""
    window = arguments.window
    if window is not None and not (math.isfinite(window) and window > 0.0):
        raise ConfigurationError(f"--window {window}: must be above 0 s")
    if arguments.plot is not None and arguments.plot.exists() and not arguments.overwrite:
        raise ConfigurationError(f"{arguments.plot}: exists already; --overwrite replaces it")
    places = recordings_at(arguments.bags)
    job = NoiseFigures(
        topic_names(arguments),
        comparison(arguments),
        arguments.config,
        arguments.preset,
        window,
        curves=arguments.plot is not None,
    )
    console, failures = SafeConsole(stderr=arguments.json == "-"), list[Failure]()
    if is_single(arguments, places):
        found = [_analysed(places[0], job)]
    else:
        with carried_out(arguments, job, places) as done:
            results = [done.results(number) for number in range(len(places))]
        found = [dict(result[WHOLE]) for result in results if WHOLE in result]
        failures = done.failures()
    drawn = [(figures["source"], figures.pop(CURVES, {})) for figures in found]
    for figures in found:
        _print_noise(console, figures)
    write_figures(arguments, {"recordings": found}, failures)
    if arguments.plot is not None and drawn:
        noise_picture(drawn, arguments.plot)
        console.print(f"drawn: {escape(str(arguments.plot))}", highlight=False, soft_wrap=True)
    return print_failures(SafeConsole(stderr=True), failures)


def _analysed(place: str, job: NoiseFigures) -> dict[str, Any]:
    """Analyse one recording in this process."""
    with Progress(console=SafeConsole(stderr=True), transient=True) as progress:
        progress.add_task(f"analysing {escape(place)}", total=None)
        with local_copy(place) as path:
            drive = job.open(place, path)
        return dict(job.run(drive, WHOLE))


def _print_noise(console: Console, document: Mapping[str, Any]) -> None:
    console.print(f"[bold]{escape(document['source'])}[/bold]", highlight=False, soft_wrap=True)
    if "motion" in document:
        console.print(_angle_table(document["motion"]))
    if "rest" in document:
        console.print(_allan_table(document["rest"]))
        console.print(_bias_table(document["rest"]))
    for warning in document["warnings"]:
        console.print(f"warning: {escape(warning)}", highlight=False, soft_wrap=True)
    for note in document["notes"]:
        console.print(f"note: {escape(note)}", highlight=False, soft_wrap=True)
    console.print()


def _angle_table(motion: Mapping[str, Any]) -> Table:
    title = f"error of the angle over {motion['duration_s']:.4g} s; "
    if motion["band_hz"] > 0.0:
        power, share = motion["tilt_area_deg2"], 100.0 * MOTION_SHARE
        title += f"motion {power:.4g} deg², {share:.0f} % below {motion['band_hz']:.3g} Hz"
    else:
        title += "nothing moves"
    headings = (
        "angle",
        "area\n[deg²]",
        "SNR\n[dB]",
        "in the motion's\nband [deg²]",
        "follows the\nmotion [%]",
    )
    rows = []
    for name in ("raw", "corrected"):
        entry = motion[name]
        share = entry["coherent_share"]
        percent = None if share is None else 100.0 * share
        rows.append((name, entry["area_deg2"], entry["snr_db"], entry["in_band_deg2"], percent))
    return _table(title, headings, rows)


def _allan_table(rest: Mapping[str, Any]) -> Table:
    title = f"Allan deviation over {rest['duration_s']:.4g} s at rest"
    times = (f"{time:g} s" for time in MARKED_TIMES)
    headings = (
        "axis",
        *times,
        "random walk\n[unit √s]",
        "bias\ninstability",
        "rate walk\n[unit/√s]",
    )
    rows = [
        (
            f"{axis} [{entry['unit']}]",
            *entry["deviation"].values(),
            entry["random_walk"],
            entry["bias_instability"],
            entry["rate_random_walk"],
        )
        for axis, entry in rest["allan"].items()
    ]
    return _table(title, headings, rows)


def _bias_table(rest: Mapping[str, Any]) -> Table:
    drift = rest["drift"]
    windows = list(zip(*drift["means_deg_s"], strict=True))
    title = f"gyro bias [{GYRO_UNIT}]; {len(windows[0])} windows of {drift['window_s']:.3g} s"
    headings = ("axis", "mean", "lowest window", "highest window", "noise area\n[(deg/s)²]")
    rows = [
        (axis, mean, min(means), max(means), rest["gyro_area_deg2_s2"][axis])
        for axis, mean, means in zip("xyz", rest["gyro_bias_deg_s"], windows, strict=True)
    ]
    return _table(title, headings, rows)


def _table(title: str, headings: Sequence[str], rows: Sequence[Sequence[Any]]) -> Table:
    table = Table(title=escape(title), title_justify="left", box=SIMPLE, padding=0)
    for index, heading in enumerate(headings):
        table.add_column(escape(heading), justify="right" if index else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(escape(_cell(value)) for value in row))
    return table


def _cell(value: float | str | None) -> str:
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:#.3g}"
