"""Jobs for tests; they are imported by worker processes, too."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from twbr_estimation.drives import load
from twbr_estimation.many.jobs import Job
from workers.work import die_at


@dataclass(frozen=True)
class Deadly(Job):
    """A job that kills its process for some recordings, so many times."""

    marks: Path
    deaths: dict[str, int]
    verb: str = "die"

    def settings(self, part: str) -> str:
        return ""

    def open(self, place: str, path: Path) -> Any:
        die_at(self.marks.with_suffix(f".{path.name}"), self.deaths.get(place, 0))
        return load(path)

    def run(self, opened: Any, part: str) -> dict[str, Any]:
        return {"samples": int(opened.recording.imu.stamps.size)}
