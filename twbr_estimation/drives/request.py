"""What is asked of each recording: filters, settings, comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ..bags import TopicNames
from ..batch.precompile import Report, compile_missing
from ..batch.running import COMPILE_AFTER
from ..scoring.score import ScoringOptions
from .drive import Drive, chosen
from .loading import load
from .runs import Runs

if TYPE_CHECKING:
    from ..smoothing import Progress


@dataclass(frozen=True, slots=True)
class RunRequest:
    """Filters to run on recordings and how, the same for each of them."""

    names: tuple[str, ...]
    """Filters to run."""
    values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    preset: str | None = None
    config: Path | None = None
    terms: tuple[str, ...] | None = None
    topics: TopicNames = field(default_factory=TopicNames)
    estimators: Mapping[str, str] = field(default_factory=dict)
    options: ScoringOptions = field(default_factory=ScoringOptions)
    loop_period: float = 0.0
    smooth: bool = False

    def drive(self, bag: Path, reference: bool) -> Drive:
        """Read one recording.

        Args:
            bag: the recording.
            reference: whether it must have a reference, or be smoothed.

        Raises:
            TwbrError: the recording or the configuration cannot be used.
        """
        return load(
            bag,
            config=self.config,
            preset=self.preset,
            terms=self.terms,
            loop_period=self.loop_period,
            topics=self.topics,
            estimators=self.estimators,
            options=self.options,
            required=("reference",) if reference and not self.smooth else (),
        )

    def runs(
        self,
        bag: Path,
        reference: bool,
        progress: Progress = lambda share: None,
        compiling: Report = lambda done, total: None,
    ) -> Runs:
        """Run the filters on one recording.

        Args:
            bag: the recording.
            reference: whether it must have a reference, or be smoothed.
            progress: called with the share of the smoothing that is done.
            compiling: called with how many loops are compiled, and of how many.

        Raises:
            TwbrError: the recording or the configuration cannot be used.
        """
        drive = self.drive(bag, reference)
        if drive.recording.imu.stamps.size > COMPILE_AFTER:
            compile_missing(chosen(self.names), compiling)
        return drive.run(*self.names, values=self.values, smooth=self.smooth, progress=progress)
