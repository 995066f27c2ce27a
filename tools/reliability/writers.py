"""Everything that writes files: how it is run, and how its output is known to be whole."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from reliability.library_writers import add_result, keep_step, record, save_calibration
from reliability.whole_output import (
    are_recordings,
    are_rows,
    is_calibration,
    is_json,
    is_page,
    is_picture,
    is_recording,
    is_setup,
    is_table,
    remove,
)
from twbr_estimation.bags import write_recording
from twbr_estimation.bags.reading import read_recording
from twbr_estimation.cli.main import main as twbr
from twbr_estimation.configuration.files import read_settings
from twbr_estimation.many.reporting import PAGE

FILTER = ("--filter", "complementary")
ONE = ("--jobs", "1")
FIGURES = (
    "evaluate --json",
    "evaluate --save-reference",
    "evaluate --results",
    "peers --json",
    "check --json",
    "balance --json",
)
"""Those of `writers` that compute figures of recordings and write them."""
PAGES = ("reproduce --json --plot", "report --overwrite", "noise --json --plot")
"""Those that draw."""
EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "arduino_log"


class Writer(NamedTuple):
    """One writer."""

    run: Callable[[Path], int]
    """Writes into a folder what it holds already, once more; returns the status."""
    sound: Callable[[Path], bool]
    """Whether what is in the folder is whole, old or new."""
    prepare: Callable[[Path], object] = Path.exists
    """Called with the folder before each run: removes what the writer would not replace."""


def writers(inputs: Path) -> dict[str, Writer]:
    """Return all writers by name.

    Args:
        inputs: Folder for the recording that some of them read; it is made where it is missing.
    """
    drive, bare = inputs / "drive", inputs / "bare"

    def on_drive(*arguments: str) -> Callable[[Path], int]:
        def run(to: Path) -> int:
            if "{drive}" in arguments or "{bare}" in arguments:
                make_drives(drive, bare)
            return verb(*[each.format(drive=drive, bare=bare, to=to) for each in arguments])

        return run

    simulate = ("simulate", "--world", "paper", "--dt", "0.01", "--duration", "4", "--seed", "1")
    again = ("--overwrite",)
    return {
        "simulate --overwrite": Writer(
            on_drive(*simulate, "-o", "{to}/bag", *again), lambda at: is_recording(at / "bag")
        ),
        "import --overwrite": Writer(
            on_drive(
                *("import", "--format", "csv", str(EXAMPLE / "log.csv"), "--columns"),
                *(str(EXAMPLE / "columns.yaml"), "-o", "{to}/bag", *again),
            ),
            lambda at: is_recording(at / "bag") and is_setup(at / "bag" / "config"),
        ),
        "evaluate --json": Writer(
            on_drive("evaluate", "{drive}", *FILTER, "--json", "{to}/e.json"),
            lambda at: is_json(at / "e.json"),
        ),
        "evaluate --save-reference": Writer(
            on_drive(
                *("evaluate", "{bare}", *FILTER, "--smooth"),
                *("--save-reference", "{to}/smoothed"),
            ),
            lambda at: not (at / "smoothed").exists() or is_recording(at / "smoothed"),
            lambda at: remove(at / "smoothed"),
        ),
        "evaluate --results": Writer(
            on_drive("evaluate", "{drive}", *FILTER, *ONE, "--results", "{to}/results.jsonl"),
            are_rows,
            lambda at: (at / "results.jsonl").unlink(missing_ok=True),
        ),
        "peers --json": Writer(
            on_drive("peers", "{drive}", *FILTER, "--peer", "vqf", "--json", "{to}/p.json"),
            lambda at: is_json(at / "p.json"),
        ),
        "reproduce --json --plot": Writer(
            on_drive(
                *("reproduce", "fig12", "--seeds", "1", *ONE),
                *("--json", "{to}/r.json", "--plot", "{to}/r.png"),
            ),
            lambda at: is_json(at / "r.json") and is_picture(at / "r.png"),
        ),
        "report --overwrite": Writer(
            on_drive("report", "{drive}", *FILTER, "-o", "{to}/report", *again),
            lambda at: is_page(at / "report" / PAGE),
        ),
        "check --json": Writer(
            on_drive("check", "{drive}", "--json", "{to}/c.json"), lambda at: is_json(at / "c.json")
        ),
        "noise --json --plot": Writer(
            on_drive("noise", "{drive}", "--json", "{to}/n.json", "--plot", "{to}/n.png", *again),
            lambda at: is_json(at / "n.json") and is_picture(at / "n.png"),
        ),
        "calibrate --overwrite": Writer(
            on_drive(
                *("calibrate", "geometry", "{drive}", "-o", "{to}/config", *again),
                *("--json", "{to}/k.json"),
            ),
            lambda at: is_setup(at / "config") and is_json(at / "k.json"),
        ),
        "tune --overwrite": Writer(
            on_drive("tune", "{drive}", *FILTER, *ONE, "-o", "{to}/filters.yaml", *again),
            lambda at: bool(read_settings(at / "filters.yaml").values),
        ),
        "urdf --overwrite": Writer(
            on_drive("urdf", "-o", "{to}/robot.urdf", *again),
            lambda at: (at / "robot.urdf").read_text().rstrip().endswith("</robot>"),
        ),
        "balance --json": Writer(
            on_drive(
                *("balance", "--world", "ideal", "--estimator", "truth", "--controller", "lqr"),
                *("--seeds", "1", "--duration", "2", *ONE, "--json", "{to}/b.json"),
            ),
            lambda at: is_json(at / "b.json"),
        ),
        "~/calibrate": Writer(save_calibration, lambda at: is_calibration(at / "calibration.yaml")),
        "recorder of the page": Writer(record, are_recordings),
        "table of results": Writer(add_result, is_table),
        "compiled steps": Writer(keep_step, lambda at: True),
    }


def verb(*arguments: str) -> int:
    """Run `twbr`."""
    sys.argv[:] = ["twbr", *arguments]
    try:
        return twbr()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1


def make_drives(drive: Path, bare: Path) -> None:
    """Make a recording and a copy of it without reference, where they are missing."""
    if not drive.exists():
        made = ("--world", "paper", "--dt", "0.01", "--duration", "12", "--seed", "3")
        verb("simulate", *made, "-o", str(drive))
    if not bare.exists():
        write_recording(bare, replace(read_recording(drive), reference=None, truth=None))
