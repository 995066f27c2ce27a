"""`noise` on many recordings: a recording is one part, and its result the figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..bags import TopicNames
from ..drives import Drive, load
from ..noise import analyse, as_json
from ..scoring.score import ScoringOptions
from .digests import digest_of_folder
from .jobs import Job


@dataclass(frozen=True, slots=True)
class NoiseFigures(Job):
    """Noise of each recording."""

    topics: TopicNames
    options: ScoringOptions
    config: Path | None = None
    preset: str | None = None
    window: float | None = None
    """For the drift of the bias [s]; by default a share of the rest."""
    verb: str = "noise"

    def settings(self, part: str) -> str:
        """Return what shapes the figures."""
        shared = digest_of_folder(self.config), self.preset, self.window
        return repr((part, self.topics, self.options, *shared))

    def open(self, place: str, path: Path) -> Drive:
        """Read a recording.

        Raises:
            TwbrError: it cannot be used.
        """
        drive = load(
            path, config=self.config, preset=self.preset, topics=self.topics, options=self.options
        )
        return replace(drive, recording=replace(drive.recording, source=place))

    def run(self, opened: Drive, part: str) -> Mapping[str, Any]:
        """Return the figures as plain data.

        Raises:
            RecordingError: there is neither a reference nor enough rest.
        """
        return as_json(analyse(opened, self.window))
