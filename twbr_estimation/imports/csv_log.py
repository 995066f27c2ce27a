"""Comma-separated logs, described by a small YAML file; see `csv_description`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..bags.decoding import Columns
from ..bags.restamping import restamped
from ..bags.wheel_repairs import COUNTERS, modulus_of
from ..bags.wheel_repairs import unwrapped as unwrapped_wheel
from ..bags.wheel_tracks import integrated, repaired_wheels
from ..errors import RecordingError
from ..recording import (
    FloatArray,
    ImuTrack,
    MotorTrack,
    Recording,
    StampArray,
    TemperatureTrack,
    TiltTrack,
    WheelTrack,
)
from ..samples import Stamps
from .csv_dates import clock_seconds, days_as_seconds
from .csv_description import MONITOR, Column, Description, read_description
from .csv_header import is_number, place_of
from .csv_numbers import numbers, with_points
from .csv_text import read_rows
from .csv_time import counter_size, spread, unwrapped
from .imported import START, ImportedLog, ImportOptions, cleaned, stamps_from_seconds

FORMAT = "comma-separated values, their columns described by the YAML of `columns`"

DROPPED = "rows that are not numbers dropped"
WRITTEN_TWICE = 0.9
"""Share of equal rows among those of one time above which they are one row, written again."""
Track = tuple[StampArray, FloatArray]


def load(path: Path, options: ImportOptions) -> ImportedLog:
    """Read one log.

    Rows that are not numbers where time, gyro or accelerometer should be (a line cut off on
    the serial port), and rows that lost fields, are dropped and counted. An empty field in
    another column means that this row has no such value.

    Raises:
        RecordingError: no description, a column that is missing, or nothing usable.
    """
    if options.description is None:
        raise RecordingError(f"{path}: its columns are not described (`columns`, a YAML file)")
    description = read_description(options.description)
    repairs: Counter[str] = Counter()
    table = _Table(path, description, repairs)
    stamps = table.stamps()
    imu, readings = table.track("imu", description.imu, stamps)
    axes = description.axes
    recording = Recording(
        source=path.name,
        imu=ImuTrack(imu, readings[:, :3] @ axes.T, readings[:, 3:] @ axes.T),
        wheels=_wheels(table, description, stamps),
        reference=_reference(table, description, stamps),
        estimators={
            name: TiltTrack(track[0], track[1][:, 0])
            for name, columns in description.estimates.items()
            if (track := table.optional(name, columns, stamps)) is not None
        },
        temperature=_temperature(table.optional("temperature", description.temperature, stamps)),
        motors=_motors(table.optional("motors", description.motors, stamps)),
    )
    recording = replace(recording, repairs=dict(repairs))
    provenance = {"columns": options.description.name, **table.provenance}
    return ImportedLog(recording, description.robot, provenance=provenance)


def _wheels(table: _Table, description: Description, stamps: StampArray) -> WheelTrack | None:
    """Return the wheels' angles, their counters gone on, or integrated from speeds."""
    if description.wheel_speeds:
        track = table.optional("wheels", description.wheel_speeds, stamps)
        if track is None:
            return None
        table.repairs["wheels: angles integrated from speeds"] += track[0].size
        angles = [integrated(track[0], speed) for speed in track[1].T]
        return WheelTrack(track[0], np.column_stack(angles))
    track = table.optional("wheels", description.wheels, stamps)
    if track is None:
        return None
    angle = track[1].copy()
    for wheel, column in enumerate(description.wheels):
        counts = angle[:, wheel] / column.scale
        modulus = description.wheel_wrap or modulus_of(track[0], counts, COUNTERS, 0.0)
        if modulus:
            counts, number = unwrapped_wheel(counts, modulus)
            angle[:, wheel] = counts * column.scale
            table.repairs[f"wheels: counter starts again at {modulus:.0f}, gone on"] += number
    return repaired_wheels("wheels", WheelTrack(track[0], angle), table.repairs)


def _temperature(track: Track | None) -> TemperatureTrack | None:
    return None if track is None else TemperatureTrack(track[0], track[1][:, 0])


def _motors(track: Track | None) -> MotorTrack | None:
    return None if track is None else MotorTrack(*track)


def _reference(table: _Table, description: Description, stamps: StampArray) -> TiltTrack | None:
    track = table.optional("reference", description.reference, stamps)
    if track is None:
        return None
    delay = round(description.reference_delay * 1e9)
    return TiltTrack(track[0] + delay, track[1][:, 0])


class _Table:
    """The log's fields as text, read column by column as numbers."""

    def __init__(self, path: Path, description: Description, repairs: Counter[str]) -> None:
        self.path, self.description, self.repairs = path, description, repairs
        text = read_rows(path, description)
        self.names, self.rows, self.arrivals = text.names, text.rows, text.arrivals
        self.decimal = text.decimal
        self.provenance: dict[str, str] = {}
        if self.arrivals:
            what = f"times of a serial monitor before each line, the first {self.arrivals[0]}"
            self.provenance["monitor"] = what
        self._count_dropped(text.dropped)

    def _count_dropped(self, number: int) -> None:
        if number:
            self.repairs[DROPPED] += number

    def stamps(self) -> StampArray:
        """Return a stamp [ns] for each row; rows without time and IMU readings are dropped."""
        seconds, first = self._seconds()
        arrivals = self._arrivals()
        columns = self.description.imu
        good = np.all([np.isfinite(seconds), *(self._finite(each) for each in columns)], axis=0)
        if not good.any():
            raise RecordingError(f"{self.path}: {self._without_numbers(seconds)}")
        self._count_dropped(int(np.count_nonzero(~good)))
        self.rows = [self.rows[row] for row in np.flatnonzero(good)]
        seconds = seconds[good]
        if self.description.time is not None:
            if not first:
                seconds = self._gone_on(seconds)
            self._require_steps(seconds)
            if not self._written_twice(seconds):
                seconds = spread(seconds, self.repairs)
        if arrivals is not None:
            seconds = self._related(seconds, arrivals[good])
        stamps = stamps_from_seconds(seconds, float(seconds[0]))
        return stamps - START + round(float(seconds[0]) * 1e9) if first else stamps

    def _written_twice(self, seconds: FloatArray) -> bool:
        """Return whether rows of one time are the same row, written more than once."""
        again = np.flatnonzero(np.diff(seconds) == 0.0) + 1
        equal = sum(self.rows[row] == self.rows[row - 1] for row in again)
        return equal > WRITTEN_TWICE * again.size

    def _require_steps(self, seconds: FloatArray) -> None:
        """Refuse a time that stands still."""
        assert self.description.time is not None
        if seconds.size > 1 and not np.ptp(seconds):
            name, reads = self.description.time.name, self._example(self.description.time)
            raise RecordingError(
                f"{self.path}: column {name!r} of the time reads {reads.strip()} in every row; "
                "give the `rate` [Hz] in its place"
            )

    def _arrivals(self) -> FloatArray | None:
        """Return when each row arrived [s]; None where that does not matter."""
        column = self.description.arrival
        if column is None:
            return None
        return self._times(column, None, has_unit=True)[0]

    def _related(self, device: FloatArray, arrivals: FloatArray) -> FloatArray:
        """Return the times of a device's clock on the clock of the arrivals [s]."""
        column, known = self.description.arrival, np.isfinite(arrivals)
        if column is not None and not known.any():
            reads = self._example(column)
            raise RecordingError(
                f"{self.path}: column {column.name!r} of the arrival holds no number, but {reads!r}"
            )
        latest = np.max((arrivals - device)[known])  # rows without one define no quickest arrival
        arrivals = np.where(known, arrivals, device + latest)
        sent = stamps_from_seconds(device, float(device.min()))
        came = stamps_from_seconds(arrivals, float(arrivals.min()))
        none = np.zeros((sent.size, 0))
        columns = Columns(sent, came, none, np.full(sent.size, "", dtype=object))
        stamps = restamped("rows", columns, Stamps.DEVICE, self.repairs).stamps
        return np.asarray((stamps - START) * 1e-9 + float(arrivals.min()), dtype=np.float64)

    def _seconds(self) -> tuple[FloatArray, bool]:
        """Return the time of each row [s], and whether it is that of a calendar."""
        if self.description.time is None:
            return np.arange(len(self.rows)) / self.description.rate, False
        given = self.description.time_has_unit
        return self._times(self.description.time, self.description.date, given)

    def _times(
        self, column: Column, date: Column | None, has_unit: bool
    ) -> tuple[FloatArray, bool]:
        """Return a column of times [s], and whether they are those of a calendar."""
        texts = self._texts(column)
        if date is not None:
            texts = [f"{day} {time}" for day, time in zip(self._texts(date), texts, strict=True)]
        found = clock_seconds(texts)
        if found is None:
            found = None if has_unit else days_as_seconds(numbers(texts))
        if found is None:
            return numbers(texts) * column.scale, False
        seconds, kind = found
        self.provenance["time"] = f"{kind}, the first {texts[0].strip()}"
        return seconds, kind.startswith("date")

    def _gone_on(self, seconds: FloatArray) -> FloatArray:
        """Return times whose counter may have started again as ones that go on."""
        assert self.description.time is not None
        scale = self.description.time.scale
        size = self.description.time_wrap or counter_size(seconds / scale, self.repairs)
        return unwrapped(seconds, size * scale)

    def _without_numbers(self, seconds: FloatArray) -> str:
        """Return which columns hold no numbers, with what one of them holds instead."""
        time = self.description.time
        if time is not None and not np.isfinite(seconds).any():
            return f"column {time.name!r} of the time holds no number, but {self._example(time)!r}"
        for column in self.description.imu:
            if not self._finite(column).any():
                return f"column {column.name!r} holds no number, but {self._example(column)!r}"
        names = ", ".join(str(column.name) for column in self.description.imu)
        return f"no row has numbers in all of {names} and a time"

    def _example(self, column: Column) -> str:
        return next((text for text in self._texts(column) if text.strip()), "")[:40]

    def optional(self, name: str, columns: Sequence[Column], stamps: StampArray) -> Track | None:
        """Return stamps and values of rows where the columns are not empty; None without any."""
        if not columns:
            return None
        filled = np.all([self._filled(column) for column in columns], axis=0)
        if not filled.any():
            raise RecordingError(f"{self.path}: the columns of {name} are empty")
        return self.track(name, columns, stamps, filled)

    def track(
        self,
        name: str,
        columns: Sequence[Column],
        stamps: StampArray,
        rows: np.ndarray | None = None,
    ) -> Track:
        """Return repaired stamps and values in SI units, (n, columns)."""
        values = np.column_stack([self._scaled(column) for column in columns])
        if rows is not None:
            stamps, values = stamps[rows], values[rows]
        return cleaned(name, stamps, values, self.repairs)

    def _scaled(self, column: Column) -> FloatArray:
        if column.name is None:
            return np.zeros(len(self.rows))
        return (self._values(column) + column.offset) * column.scale

    def _finite(self, column: Column) -> np.ndarray:
        return np.isfinite(self._scaled(column))

    def _filled(self, column: Column) -> np.ndarray:
        return np.array([text.strip() != "" for text in self._texts(column)])

    def _texts(self, column: Column) -> list[str]:
        """Return the fields of a column; empty ones where a row is too short."""
        if column.name == MONITOR and self.arrivals and MONITOR not in self.names:
            return self.arrivals
        place = self._place(column)
        texts = [row[place] if len(row) > place else "" for row in self.rows]
        if self.decimal != ".":
            texts = [with_points(text, self.decimal) for text in texts]
        return texts

    def _values(self, column: Column) -> FloatArray:
        return numbers(self._texts(column))

    def _place(self, column: Column) -> int:
        if column.name == MONITOR and MONITOR not in self.names:
            raise RecordingError(
                f"{self.path}: no time of a serial monitor stands before its lines; name the "
                "column of the computer's time in `columns.arrival`"
            )
        if isinstance(column.name, int):
            return column.name
        try:
            place = place_of(str(column.name), self.names)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from None
        if place is None and self.names and all(map(is_number, self.names)):
            raise RecordingError(
                f"{self.path}: its first row holds numbers: it has no header with the name "
                f"{column.name!r}; give the columns by number, from 0"
            )
        if place is None:
            raise RecordingError(
                f"{self.path}: has no column {column.name!r}; it has {', '.join(self.names)[:500]}"
            )
        return place
