"""`check` on many recordings: a recording is one part, and its result what was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..bags import TopicNames
from ..bags.static_frames import FrameSource
from ..checks.finding import Finding, Severity
from ..checks.suitability import suitability
from ..checks.table import as_json
from ..configuration.frames import urdf_frames
from ..drives import Drive, load
from .digests import digest_of_folder
from .jobs import Job


def findings_of(drive: Drive) -> list[Finding]:
    """Return all that is found about a recording: description, repairs, data, use."""
    repairs = [
        Finding(Severity.WARN, "bag", "repair", f"repaired: {repair}: {count}")
        for repair, count in drive.recording.repairs.items()
    ]
    notes = [Finding(Severity.WARN, "robot", "description", note) for note in drive.notes]
    found = [*notes, *repairs, *drive.findings]
    return [*found, *suitability(drive.recording, found)]


@dataclass(frozen=True, slots=True)
class Checking(Job):
    """Findings of each recording."""

    topics: TopicNames
    config: Path | None = None
    preset: str | None = None
    frames: FrameSource | None = None
    """Where the IMU's mounting comes from; None takes it as configured."""
    verb: str = "check"

    def settings(self, part: str) -> str:
        """Return what shapes the findings."""
        return repr((part, self.topics, digest_of_folder(self.config), self.preset, self._frames()))

    def _frames(self) -> str:
        """Return what shapes the mounting."""
        if self.frames is None or self.frames.urdf is None:
            return repr(self.frames)
        return repr((self.frames, [str(each) for each in urdf_frames(self.frames.urdf)]))

    def open(self, place: str, path: Path) -> Drive:
        """Read a recording.

        Raises:
            TwbrError: it cannot be used.
        """
        drive = load(path, config=self.config, preset=self.preset, topics=self.topics)
        if self.frames is not None:
            robot = self.frames.robot(drive.setup.robot, path)
            drive = drive.with_setup(replace(drive.setup, robot=robot))
        return replace(drive, recording=replace(drive.recording, source=place))

    def run(self, opened: Drive, part: str) -> Mapping[str, Any]:
        """Return the findings."""
        return {
            "samples": int(opened.recording.imu.stamps.size),
            "duration_s": opened.recording.duration,
            "findings": as_json(findings_of(opened)),
        }
