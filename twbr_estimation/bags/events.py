"""The periods in which something happens to the robot, as a table beside a recording."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from ..errors import RecordingError
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


def read_events(folder: Path) -> tuple[Event, ...]:
    """Return the periods of a recording; none where it has no table.

    Raises:
        RecordingError: a table that cannot be read.
    """
    path = folder / EVENTS_FILE
    if not path.is_file():
        return ()
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        if tuple(rows[0]) != COLUMNS:
            raise ValueError(f"its columns are not {', '.join(COLUMNS)}")
        return tuple(Event(name, int(begin), int(end)) for name, begin, end in rows[1:])
    except (OSError, ValueError, IndexError) as error:
        raise RecordingError(f"{path}: is no table of events: {error}") from None
