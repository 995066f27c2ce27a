"""Everything that writes files: how it is run, and how its output is known to be whole."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import yaml

from twbr_estimation.bags.reading import read_recording
from twbr_estimation.bags.recorder import BagRecorder
from twbr_estimation.bags.topics import IMU, TopicNames
from twbr_estimation.cli.main import main as twbr
from twbr_estimation.configuration.files import read_settings, read_setup, write_section
from twbr_estimation.errors import TwbrError
from twbr_estimation.live_code.files import ObjectCode, kept, saved
from twbr_estimation.many.reporting import PAGE
from twbr_estimation.many.results import ResultTable
from twbr_estimation.robot import Calibration
from twbr_estimation.ros_messages import ACCEL, GYRO, IMU_DOUBLES
from twbr_estimation.streams.messages import ImuEncoder

FILTER = ("--filter", "complementary")
ONE = ("--jobs", "1")
EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "arduino_log"


class Writer(NamedTuple):
    """One writer."""

    run: Callable[[Path], int]
    """Writes into a folder what it holds already, once more; returns the status."""
    sound: Callable[[Path], bool]
    """Whether what is in the folder is whole, old or new."""


def writers(inputs: Path) -> dict[str, Writer]:
    """Return all writers by name.

    Args:
        inputs: Folder for the recording that some of them read; it is made where it is missing.
    """
    drive = inputs / "drive"

    def on_drive(*arguments: str) -> Callable[[Path], int]:
        def run(to: Path) -> int:
            if "{drive}" in arguments and not drive.exists():
                made = ("--world", "paper", "--dt", "0.01", "--duration", "12", "--seed", "3")
                verb("simulate", *made, "-o", str(drive))
            return verb(*[each.format(drive=drive, to=to) for each in arguments])

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
            on_drive("calibrate", "geometry", "{drive}", "-o", "{to}/config", *again),
            lambda at: is_setup(at / "config"),
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


def said(error: TwbrError) -> int:
    """Print an error as `twbr` does; return the status."""
    print(f"error: {error}", file=sys.stderr)
    return 1


def save_calibration(to: Path) -> int:
    """Save what the service of a node saves."""
    provenance: dict[str, str | float] = {"source": "a service", "duration": 3.0}
    try:
        write_section(to / "calibration.yaml", Calibration(), provenance, replace=True)
    except TwbrError as error:
        return said(error)
    return 0


def record(to: Path) -> int:
    """Record a new drive of 2 MB, as the page does."""
    try:
        recorder = BagRecorder(to / "new", {TopicNames().imu: IMU})
        for number in range(6_000):
            recorder.add(TopicNames().imu, number * 5_000_000, message(number))
        recorder.close()
    except TwbrError as error:
        return said(error)
    return 0


def message(number: int) -> bytes:
    """Return a serialised Imu."""
    values = [0.0] * IMU_DOUBLES
    values[4], values[GYRO], values[ACCEL] = -1.0, 1e-4 * number, 9.8
    return bytes(ImuEncoder("imu_link").encode(1_700_000_000 * 10**9 + 5_000_000 * number, values))


def remove(folder: Path) -> None:
    """Delete a folder of files."""
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()


def add_result(to: Path) -> int:
    """Append a row of a thousand numbers to a table."""
    try:
        table = ResultTable(to / "results.jsonl")
        table.append([{"key": "row", "numbers": list(range(1000))}])
        table.close()
    except TwbrError as error:
        return said(error)
    return 0


def keep_step(to: Path) -> int:
    """Keep machine code as the compiler of the live path does."""
    os.environ["NUMBA_CACHE_DIR"] = str(to)
    code = ObjectCode("step", bytes(300_000))
    path = saved("filter", "digest", code)
    return 0 if path is None or kept("filter", "digest") == code else 1


def is_recording(path: Path) -> bool:
    """Return whether a recording can be read, all of it."""
    return read_recording(path).imu.stamps.size > 0 and (path / "metadata.yaml").exists()


def are_recordings(folder: Path) -> bool:
    """Return whether the old recording is whole, and the new one where there is one.

    What says that it was cut off can be read as well. The new one becomes the old one.
    """
    for cut_off in folder.glob("new_cut_off*"):
        if not read_recording(cut_off).imu.stamps.size:
            return False
        remove(cut_off)
    old, new = folder / "old", folder / "new"
    if new.exists() and is_recording(new):
        if old.exists():
            remove(old)
        new.rename(old)
    return not new.exists() and next(old.glob("*.mcap")).exists()


def is_json(path: Path) -> bool:
    """Return whether a file is JSON."""
    return bool(json.loads(path.read_text()))


def is_page(path: Path) -> bool:
    """Return whether a page has its end."""
    return path.read_text().rstrip().endswith("</html>")


def is_picture(path: Path) -> bool:
    """Return whether a PNG has its end."""
    return path.read_bytes().rstrip().endswith(b"IEND\xaeB`\x82")


def is_setup(folder: Path) -> bool:
    """Return whether robot and calibration can be read."""
    return bool(read_setup(folder)) and is_calibration(folder / "calibration.yaml")


def is_calibration(path: Path) -> bool:
    """Return whether a file is YAML with its provenance at the end."""
    return "provenance" in yaml.safe_load(path.read_text())["/**"]["ros__parameters"]


def is_table(folder: Path) -> bool:
    """Return whether a table has its row."""
    table = ResultTable(folder / "results.jsonl")
    found = len(table.row("row")["numbers"])
    table.close()
    return found == 1000
