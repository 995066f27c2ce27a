"""Writers that are killed.

Commands that rewrite their output are killed with SIGKILL at random instants. Each time the output
has to be whole, the old one or the new one, and the next run leaves no temporary file.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from reliability.killing import Command, Sound, emptied, killed
from reliability.row import Effort, Row
from twbr_estimation.bags.reading import read_recording
from twbr_estimation.errors import TwbrError
from twbr_estimation.many.reporting import PAGE

ROOT = Path(__file__).resolve().parents[3]
BAG = str(ROOT / "bags" / "training")
KILLS = 200
SECONDS = "2"
FILTER = ("--filter", "complementary")


def rows(effort: Effort) -> Iterator[Row]:
    """Kill every writer."""
    for name, (command, sound) in writers().items():
        with TemporaryDirectory(prefix="twbr_killed_") as folder:
            place = emptied(Path(folder) / "place")
            counts = killed(command, sound, place, effort.tries(KILLS), effort.seed)
        tries = counts["whole"] + counts["broken"]
        seen = (
            f"{counts['whole']} whole, {counts['broken']} broken; {counts['ended']} had ended; "
            f"{counts['left over']} temporary files after the next run"
        )
        fine = counts["broken"] == counts["left over"] == 0
        yield Row(name, tries, "old or new, no temporary file after the next run", seen, fine)


def writers() -> dict[str, tuple[Command, Sound]]:
    """Return the commands by name, with what looks at their output."""
    simulate = ("simulate", "--world", "paper", "--dt", "0.01", "--duration", SECONDS)
    return {
        "simulate --overwrite": (
            lambda to: (*simulate, "--seed", "1", "-o", str(to / "bag"), "--overwrite"),
            lambda at: _is_recording(at / "bag"),
        ),
        "evaluate --json": (
            lambda to: ("evaluate", BAG, *FILTER, "--json", str(to / "e.json")),
            lambda at: _is_json(at / "e.json"),
        ),
        "report --overwrite": (
            lambda to: ("report", BAG, *FILTER, "-o", str(to / "report"), "--overwrite"),
            lambda at: (at / "report" / PAGE).read_text().rstrip().endswith("</html>"),
        ),
    }


def _is_recording(path: Path) -> bool:
    try:
        return read_recording(path).imu.stamps.size > 0
    except TwbrError:
        return False


def _is_json(path: Path) -> bool:
    try:
        json.loads(path.read_text())
    except (OSError, ValueError):
        return False
    return True
