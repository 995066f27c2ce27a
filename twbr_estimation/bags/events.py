"""The periods in which something happens to the robot, as a table beside a recording."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from ..recording import Event

EVENTS_FILE = "events.csv"
"""Name of the table inside a recording's folder."""
COLUMNS = ("event", "begin_ns", "end_ns")


def write_events(folder: Path, events: Sequence[Event]) -> None:
    """Write `events.csv`, one period a row; nothing where there are none."""
    if not events:
        return
    with (folder / EVENTS_FILE).open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(events)
