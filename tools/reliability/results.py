"""The campaign's results: kept as JSON, part by part, and written as a page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reliability.row import Row

HEAD = """# Reliability

Written by `python tools/campaign.py`; do not edit. The tools it is made of, in
[tools/reliability](../tools/reliability/), also try a driver or a node of your own:

* `random_messages.py` publishes wild and sound messages on all topics of a graph.
* `live_robot.py` kills and stops the nodes of a balancing robot and counts the commands.
* `fed_controller.py` feeds a controller by hand and counts what it commands; `motor_causes.py` and
  `motor_ends.py` bring about what must stop it, `set_clock.py` sets its clock.
* `random_devices.py` stands between a driver and its chip, counter or port and spoils answers.
* `writer_trials.py` kills what writes, and fills its disk; `writers.py` lists what does, and
  `file_faults.py` lets a call of the system fail.
* `two_hosts.py` puts a cable between the sensors of a robot and its nodes, and pulls it.
* `live_path.py` and `motions.py` run a filter as the nodes do and compare it with the truth.

`python tools/campaign.py --list` names the parts; each runs alone, and `--scale` shortens it. A
part that cannot run on a machine says so and leaves its rows as they were.
"""


def load(path: Path) -> dict[str, Any]:
    """Return the parts kept in a file; none where it does not exist."""
    if not path.exists():
        return {}
    kept: dict[str, Any] = json.loads(path.read_text())
    return kept


def keep(path: Path, part: str, about: str, rows: list[Row]) -> None:
    """Put the rows of a part into the file in the place of its earlier ones."""
    kept = load(path)
    kept[part] = {"about": about, "rows": [row._asdict() for row in rows]}
    path.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n")


def page(parts: Mapping[str, Any]) -> str:
    """Return the page: a table for each part."""
    lines = [HEAD]
    for part in parts.values():
        lines += [f"## {part['about'].rstrip('.')}", ""]
        lines += ["| test | tries | promised | seen | verdict |", "|---|---|---|---|---|"]
        lines += [_line(Row(**each)) for each in part["rows"]] + [""]
    return "\n".join(lines)


def _line(row: Row) -> str:
    cells = (row.test, f"{row.tries:,}".replace(",", " "), row.promised, row.seen)
    escaped = (each.replace("|", "\\|").replace("\n", " ") for each in cells)
    return f"| {' | '.join(escaped)} | {'held' if row.held else '**fell short**'} |"
