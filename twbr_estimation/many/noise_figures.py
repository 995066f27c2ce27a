"""`noise` on many recordings: a recording is one part, and its result the figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..bags import TopicNames
from ..drives import Drive, load
from ..noise import analyse, as_json
from ..noise.curves import curves_of
from ..scoring.score import ScoringOptions
from .digests import digest_of_folder
from .jobs import Job

CURVES = "curves"


@dataclass(frozen=True, slots=True)
class NoiseFigures(Job):
    """Noise of each recording."""

    topics: TopicNames
    options: ScoringOptions
    config: Path | None = None
    preset: str | None = None
    window: float | None = None
    """For the drift of the bias [s]; by default a share of the rest."""
    curves: bool = False
    """Whether results hold the curves of a picture, too: some thousand numbers."""
    verb: str = "noise"

    def settings(self, part: str) -> str:
        """Return what shapes the figures."""
        shared = digest_of_folder(self.config), self.preset, self.window
        drawn = ("curves",) if self.curves else ()
        return repr((part, self.topics, self.options, *shared, *drawn))

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
        """Return the figures as plain data; curves are under the key `CURVES`.

        Raises:
            RecordingError: there is neither a reference nor enough rest.
        """
        noise = analyse(opened, self.window)
        figures = as_json(noise)
        return {**figures, CURVES: curves_of(noise)} if self.curves else figures
