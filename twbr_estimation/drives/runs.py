"""Results of filters on one recording: estimates, figures, a plot, a table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..batch import EstimateTrack
from ..batch.judging import trusted_share
from ..checks.finding import noteworthy
from ..checks.quick import contradicted
from ..checks.table import as_json
from ..errors import ConfigurationError
from ..filters import Filter
from ..parameters.argument_checks import require_kind, shown
from ..recording import FloatArray, Recording, TiltTrack
from ..scoring.score import SMOOTHED, RecordingScore, ScoringOptions, score_recording
from .warnings import warnings_for

if TYPE_CHECKING:
    from ..smoothing import SmoothedTrack
    from .drive import Drive

FIELDS = ("tilt", "rate", "gyro_bias", "tilt_variance")
"""What a filter estimates, in the order of the columns of a table."""


class Runs(Mapping[str, EstimateTrack]):
    """Estimates by filter name: `runs["kalman"].tilt` is an array over `runs["kalman"].time`."""

    def __init__(
        self,
        drive: Drive,
        entries: tuple[Filter, ...],
        values: Mapping[str, Mapping[str, float]],
        estimates: Mapping[str, EstimateTrack],
        smoothed: SmoothedTrack | None = None,
    ) -> None:
        """Keep the results; `Drive.run` makes it.

        Args:
            drive: the recording.
            entries: the filters.
            values: parameter values in force by filter name.
            estimates: by filter name.
            smoothed: the tilt with hindsight, where it was asked for.
        """
        self.drive = drive
        self.entries = entries
        self.parameters = values
        """Parameter values in force by filter name; missing ones are the filter's defaults."""
        self.smoothed = smoothed
        self._estimates = dict(estimates)

    def __getitem__(self, name: str) -> EstimateTrack:
        if not isinstance(name, str) or name not in self._estimates:
            raise KeyError(f"{shown(name)} was not run; there are: {', '.join(self)}")
        return self._estimates[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._estimates)

    def __len__(self) -> int:
        return len(self._estimates)

    def __repr__(self) -> str:
        return f"<Runs of {', '.join(self)} on {self.drive.source}>"

    @cached_property
    def compared(self) -> Drive:
        """The drive with its reference: the smoothed tilt where it has none of its own."""
        if self.drive.recording.reference is None and self.smoothed is not None:
            options = ScoringOptions(
                skip=self.drive.options.skip
            )  # delay and offset: of an encoder
            return replace(self.drive, options=options).with_reference(self.smoothed.as_track())
        return self.drive

    @property
    def recording(self) -> Recording:
        """The recording, with its reference or the smoothed tilt in place of one."""
        return self.compared.recording

    @cached_property
    def tracks(self) -> dict[str, TiltTrack]:
        """Tilt by name of each filter and each estimator of the recording."""
        found = {name: TiltTrack(run.stamps, run.tilt) for name, run in self.items()}
        found.update(self.drive.recording.estimators)
        if self.smoothed is not None and self.drive.recording.reference is not None:
            found[SMOOTHED] = self.smoothed.as_track()
        return found

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about figures made with these settings."""
        settings = warnings_for(self.drive, self.entries, self.parameters)
        return (*settings, *self.drive.notes, *self._remarks())

    def _remarks(self) -> Iterator[str]:
        """Yield what the filters believed to be wrong with their inputs, at the end or before."""
        for entry in self.entries:
            state, time = self[entry.name].state, self.wheels_ignored.get(entry.name, 0.0)
            if state is None:
                continue
            now = entry.remarks(state)
            if time > 0.0 and not now:
                now = ("the wheels contradicted the IMU: lifted, slipping or wrong",)
            ignored = f"; wheels ignored for {time:.1f} s of the recording" if time else ""
            if ignored:
                now = tuple(remark.removesuffix("; wheels ignored") for remark in now)
            yield from (f"{entry.name}: {remark}{ignored}" for remark in now)

    @cached_property
    def wheels_ignored(self) -> dict[str, float]:
        """Time for which wheels were ignored [s], by name of each filter that checks them."""
        return {
            entry.name: float(entry.wheels_ignored(self[entry.name].state))
            for entry in self.entries
            if entry.wheels_ignored is not None and self[entry.name].state is not None
        }

    @cached_property
    def trusted(self) -> dict[str, float]:
        """Share of the estimates that a live stream would call valid, by filter name.

        It falls with gaps, saturated and frozen readings, disagreement with gravity, and with
        sensors that contradict each other, as of a wrong sign. The samples are judged one by one
        when it is first asked for.
        """
        corrected = self.drive.corrected
        usable = ~contradicted(corrected.columns)
        return {
            e.name: trusted_share(e, corrected, self[e.name], usable=usable) for e in self.entries
        }

    @cached_property
    def score(self) -> RecordingScore | None:
        """The errors against the reference as `Drive.options` has it; None without one."""
        return None if self.recording.reference is None else self.scores()

    def scores(self, options: ScoringOptions | None = None) -> RecordingScore:
        """Compare every estimate with the reference; printed, it is the table of `twbr evaluate`.

        Args:
            options: how to compare; by default as the drive was loaded.

        Raises:
            RecordingError: there is no reference, or no estimate overlaps with it.
            ConfigurationError: `options` of another type.
        """
        chosen = self.compared.options if options is None else options
        require_kind("options", chosen, ScoringOptions, "ScoringOptions")
        shared = self.compared.association if options is None else None
        score = score_recording(self.recording, self.tracks, chosen, self.warnings, shared)
        found = as_json(noteworthy(self.drive.findings))
        score = replace(score, findings=found, wheels_ignored_s=self.wheels_ignored)
        if self.smoothed is None:
            return score
        score = replace(score, smoothed_deviation_deg=math.degrees(self.smoothed.deviation))
        return score if self.drive.recording.reference else replace(score, reference=SMOOTHED)

    def plot(self, axes: Any | None = None) -> Any:
        """Draw tilt [deg] over time [s] and return the matplotlib axes.

        Args:
            axes: where to draw; a new figure by default.

        Raises:
            ConfigurationError: matplotlib is not installed, or `axes` cannot be drawn on.
        """
        from .plotting import plot

        return plot(self, axes)

    def to_columns(self) -> dict[str, FloatArray]:
        """Return a table as one array a column, which pandas, polars and others take as it is.

        Columns: `time` [s], `reference` [rad] where there is one (nan where it has a gap), then
        `FILTER.tilt`, `FILTER.rate`, `FILTER.gyro_bias`, `FILTER.tilt_variance` for each filter.
        """
        if not self:
            return {}
        first = next(iter(self._estimates.values()))
        columns = {"time": first.time}
        if (association := self.compared.association) is not None:
            tilt, known = association.at(first.stamps)
            columns["reference"] = np.where(known, tilt, np.nan)
        for name, run in self.items():
            columns.update({f"{name}.{each}": getattr(run, each) for each in FIELDS})
        return columns

    def to_numpy(self) -> np.ndarray[Any, Any]:
        """Return the table of `to_columns` as a structured array, (n,)."""
        columns = self.to_columns()
        table = np.empty(
            next(iter(columns.values()), np.empty(0)).size, [(name, float) for name in columns]
        )
        for name, values in columns.items():
            table[name] = values
        return table

    def to_pandas(self) -> Any:
        """Return the table of `to_columns` as a pandas DataFrame.

        Raises:
            ConfigurationError: pandas is not installed.
        """
        return _frame("pandas", self.to_columns())

    def to_polars(self) -> Any:
        """Return the table of `to_columns` as a polars DataFrame.

        Raises:
            ConfigurationError: polars is not installed.
        """
        return _frame("polars", self.to_columns())


def _frame(package: str, columns: Mapping[str, FloatArray]) -> Any:
    from importlib import import_module

    try:
        return import_module(package).DataFrame(columns)
    except ImportError as error:
        raise ConfigurationError(f"a DataFrame needs {package}: pip install {package}") from error
