"""Whether what a writer left behind is whole: read as its readers read it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import yaml

from twbr_estimation.bags.reading import read_recording
from twbr_estimation.configuration.files import read_setup
from twbr_estimation.many.results import ResultTable


def remove(folder: Path) -> None:
    """Delete a folder, if there is one."""
    if folder.exists():
        shutil.rmtree(folder)


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


def are_rows(folder: Path) -> bool:
    """Return whether a table has whole rows only, once it has been opened."""
    path = folder / "results.jsonl"
    ResultTable(path).close()
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    return all("key" in row for row in rows)
