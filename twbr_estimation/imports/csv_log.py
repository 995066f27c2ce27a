"""Comma-separated logs, described by a small YAML file; see `csv_description`."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from ..recording import (
    FloatArray,
    ImuTrack,
    Recording,
    StampArray,
    TemperatureTrack,
    TiltTrack,
    WheelTrack,
)
from .csv_description import Column, Description, read_description
from .imported import ImportedLog, Options, cleaned, stamps_from_seconds

FORMAT = "comma-separated values, their columns described with --columns YAML"

Track = tuple[StampArray, FloatArray]


def load(path: Path, options: Options) -> ImportedLog:
    """Read one log.

    Rows that are not numbers where time, gyro or accelerometer should be (a line cut off on
    the serial port) are dropped and counted. An empty field in another column means that
    this row has no such value.

    Raises:
        RecordingError: no description, a column that is missing, or nothing usable.
    """
    if options.description is None:
        raise RecordingError(f"{path}: say with `columns` what its columns are")
    description = read_description(options.description)
    table = _Table(path, description)
    repairs: Counter[str] = Counter()
    stamps = table.stamps(repairs)
    imu, readings = table.track("imu", description.imu, stamps, repairs)
    axes = description.axes
    recording = Recording(
        source=path.name,
        imu=ImuTrack(imu, readings[:, :3] @ axes.T, readings[:, 3:] @ axes.T),
        wheels=_wheels(table.optional("wheels", description.wheels, stamps, repairs)),
        reference=_reference(table, description, stamps, repairs),
        temperature=_temperature(
            table.optional("temperature", description.temperature, stamps, repairs)
        ),
    )
    recording = replace(recording, repairs=dict(repairs))
    provenance = {"columns": options.description.name}
    return ImportedLog(recording, description.robot, provenance=provenance)


def _wheels(track: Track | None) -> WheelTrack | None:
    return None if track is None else WheelTrack(*track)


def _temperature(track: Track | None) -> TemperatureTrack | None:
    return None if track is None else TemperatureTrack(track[0], track[1][:, 0])


def _reference(
    table: _Table, description: Description, stamps: StampArray, repairs: Counter[str]
) -> TiltTrack | None:
    track = table.optional("reference", description.reference, stamps, repairs)
    if track is None:
        return None
    delay = round(description.reference_delay * 1e9)
    return TiltTrack(track[0] + delay, track[1][:, 0])


class _Table:
    """The log's fields as text, read column by column as numbers."""

    def __init__(self, path: Path, description: Description) -> None:
        self.path, self.description = path, description
        try:
            with path.open(newline="", encoding="utf-8-sig", errors="replace") as file:
                lines = [row for row in csv.reader(file, delimiter=description.delimiter) if row]
        except (OSError, csv.Error) as error:
            raise RecordingError(f"{path}: cannot be read: {error}") from error
        lines = lines[description.skip_rows :]
        if description.has_header:
            self.names = [name.strip() for name in lines[0]] if lines else []
            lines = lines[1:]
        else:
            self.names = []
        if not lines:
            raise RecordingError(f"{path}: holds no rows")
        self.rows = lines

    def stamps(self, repairs: Counter[str]) -> StampArray:
        """Return a stamp [ns] for each row; rows without time and IMU readings are dropped."""
        columns = (self.description.time, *self.description.imu)
        good = np.all([np.isfinite(self._scaled(column)) for column in columns], axis=0)
        if not good.any():
            names = ", ".join(str(column.name) for column in columns)
            raise RecordingError(f"{self.path}: no row has numbers in all of {names}")
        if not good.all():
            repairs["rows that are not numbers dropped"] += int(np.sum(~good))
            self.rows = [self.rows[row] for row in np.flatnonzero(good)]
        time = unwrapped(self._values(self.description.time), self.description.time_wrap)
        return stamps_from_seconds((time - time[0]) * self.description.time.scale, 0.0)

    def optional(
        self, name: str, columns: Sequence[Column], stamps: StampArray, repairs: Counter[str]
    ) -> Track | None:
        """Return stamps and values of rows where the columns are not empty; None without any."""
        if not columns:
            return None
        filled = np.all([self._filled(column) for column in columns], axis=0)
        if not filled.any():
            raise RecordingError(f"{self.path}: the columns of {name} are empty")
        return self.track(name, columns, stamps, repairs, filled)

    def track(
        self,
        name: str,
        columns: Sequence[Column],
        stamps: StampArray,
        repairs: Counter[str],
        rows: np.ndarray | None = None,
    ) -> Track:
        """Return repaired stamps and values in SI units, (n, columns)."""
        values = np.column_stack([self._scaled(column) for column in columns])
        if rows is not None:
            stamps, values = stamps[rows], values[rows]
        return cleaned(name, stamps, values, repairs)

    def _scaled(self, column: Column) -> FloatArray:
        if column.name is None:
            return np.zeros(len(self.rows))
        return (self._values(column) + column.offset) * column.scale

    def _filled(self, column: Column) -> np.ndarray:
        place = self._place(column)
        return np.array([len(row) > place and row[place].strip() != "" for row in self.rows])

    def _values(self, column: Column) -> FloatArray:
        place = self._place(column)
        texts = (row[place] if len(row) > place else "" for row in self.rows)
        if self.description.decimal != ".":
            texts = (text.replace(self.description.decimal, ".") for text in texts)
        return np.fromiter(map(_number, texts), dtype=np.float64, count=len(self.rows))

    def _place(self, column: Column) -> int:
        if isinstance(column.name, int):
            return column.name
        try:
            return self.names.index(str(column.name))
        except ValueError:
            raise RecordingError(
                f"{self.path}: has no column {column.name!r}; it has {', '.join(self.names)}"
            ) from None


def unwrapped(counter: FloatArray, modulus: float) -> FloatArray:
    """Return a counter that started again at `modulus` as one that went on; 0 means never.

    A step back by more than half the modulus counts as a new start.
    """
    if not modulus:
        return counter
    turns = np.cumsum(np.diff(counter, prepend=counter[0]) < -modulus / 2.0)
    return counter + modulus * turns


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
