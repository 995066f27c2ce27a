"""Comma-separated lines of a microcontroller, described as the columns of a log are.

`twbr import` and the serial port read the same description: see `imports.csv_description`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...errors import ConfigurationError
from ..wheel_rates import WheelRates
from .binary_frames import DeviceSample, FrameError

if TYPE_CHECKING:
    from ...imports.csv_description import Column, Description

DELIMITERS = ",;\t"
NANOSECOND = 1e-9
_LABELLED = re.compile(r"([A-Za-z]\w*)\s*[:=]\s*([^:=]*)")
_UNIT = re.compile(r"\s*[\[(].*[\])]\s*$")


class LineDecoder:
    """Decodes lines; columns given by name wait for the header that names them."""

    def __init__(self, description: Description) -> None:
        """Decode lines of this description.

        Raises:
            ConfigurationError: the description has an entry that a live stream does not support.
        """
        if description.rate:
            raise ConfigurationError("rate: a serial port needs a column of time, or `arrival`")
        if description.wheel_speeds and description.time is None:
            raise ConfigurationError(
                "columns.wheel_speeds: speeds are integrated, which needs a column of time"
            )
        if description.date is not None:
            raise ConfigurationError("columns.time: a serial port takes one column, of numbers")
        self._description = description
        self._rates, self._elapsed, self._ticks = WheelRates(), 0, 0
        self._names: list[str] | None = None
        self._places: dict[str, int] = {}
        self._turns = [0.0] * len(description.wheels)
        self._last_counts: list[float | None] = [None] * len(description.wheels)
        self._fields = 0

    @property
    def ticks_of_wrap(self) -> int:
        """After how many nanoseconds the device's time starts again; 0 if it does not."""
        time, wrap = self._description.time, self._description.time_wrap
        return 0 if time is None or not wrap else round(wrap * time.scale / NANOSECOND)

    def decode(self, line: str) -> DeviceSample | None:
        """Return the sample of a line; None for a header or an empty line.

        Raises:
            FrameError: a line that was cut off or disturbed, or that has no header yet.
        """
        fields = self._without_names(self._split(line.strip()))
        if not fields or self._took_header(fields):
            return None
        if self._fields and len(fields) != self._fields:
            raise FrameError(f"a line has {len(fields)} fields, needed are {self._fields}")
        described = self._description
        raw = [self._value(column, fields) for column in described.imu]
        axes = described.axes
        gyro = tuple(float(value) for value in axes @ raw[:3])
        accel = tuple(float(value) for value in axes @ raw[3:])
        ticks = None
        if described.time is not None:
            ticks = round(self._value(described.time, fields) / NANOSECOND)
        wheels = self._wheels(fields)
        if ticks is not None and described.wheel_speeds:
            wheels = self._rolled(ticks, fields)
        return DeviceSample(ticks, gyro, accel, wheels)

    def _rolled(self, ticks: int, fields: list[str]) -> tuple[float, ...]:
        """Return the wheel angles by their speeds, since the first line."""
        step, wrap = ticks - self._ticks, self.ticks_of_wrap
        if wrap and step < -wrap // 2:
            step += wrap
        self._elapsed, self._ticks = self._elapsed + step, ticks
        speeds = [self._value(column, fields) for column in self._description.wheel_speeds]
        return tuple(self._rates.add(self._elapsed, speeds))

    def _split(self, line: str) -> list[str]:
        delimiter = self._description.delimiter
        if delimiter is None:
            delimiter = max(DELIMITERS, key=line.count)
        fields = line.split() if delimiter == " " else line.split(delimiter)
        return [each.strip() for each in fields] if line else []

    def _without_names(self, fields: list[str]) -> list[str]:
        """Return the fields of `gx:0.1,gy:0.2`, the form of serial plotters, without the names."""
        if not fields or not _LABELLED.fullmatch(fields[0]):
            return fields
        found = [_LABELLED.fullmatch(each) for each in fields]
        labels = [match[1] for match in found if match]
        if not labels or len(labels) < len(fields):
            return fields
        if labels != self._names:
            self._names, self._fields = None, 0
            self._took_header(labels)
        return [match[2] for match in found if match]

    def _took_header(self, fields: list[str]) -> bool:
        """Take a header: a line of names, among them all that are asked for."""
        wanted = [column.name for column in self._columns() if isinstance(column.name, str)]
        if not wanted:
            self._fields = self._fields or self._description.fields
            return self._names is None and not _is_number(fields[0]) and self._begin(fields)
        if all(_place(name, fields) is not None for name in wanted):
            return self._begin(fields)
        if self._names is None:
            raise FrameError(
                f"no header has come that names {', '.join(map(repr, wanted))}; number the "
                "columns in the description where the device sends none"
            )
        return False

    def _begin(self, fields: list[str]) -> bool:
        self._names, self._fields = fields, len(fields)
        named = [each.name for each in self._columns() if isinstance(each.name, str)]
        places = {name: _place(name, fields) for name in named}
        self._places = {name: place for name, place in places.items() if place is not None}
        return True

    def _columns(self) -> Sequence[Column]:
        described = self._description
        time = () if described.time is None else (described.time,)
        return (*time, *described.imu, *described.wheels, *described.wheel_speeds)

    def _value(self, column: Column, fields: list[str]) -> float:
        index = column.name
        if index is None:
            return 0.0
        if isinstance(index, str):
            index = self._places[index]
        try:
            number = float(fields[index].replace(self._description.decimal or ".", "."))
        except (ValueError, IndexError):
            raise FrameError(f"column {column.name} of a line is no number") from None
        if not math.isfinite(number):
            raise FrameError(f"column {column.name} of a line is not finite")
        return column.scale * (number + column.offset)

    def _wheels(self, fields: list[str]) -> tuple[float, ...]:
        """Return the wheel angles; a counter that starts again goes on."""
        wrap = self._description.wheel_wrap
        found = []
        for index, column in enumerate(self._description.wheels):
            angle = self._value(column, fields)
            if wrap:
                turn, last = wrap * abs(column.scale), self._last_counts[index]
                if last is not None:
                    self._turns[index] -= turn * round((angle - last) / turn)
                self._last_counts[index] = angle
                angle += self._turns[index]
            found.append(angle)
        return tuple(found)


def _place(name: str, names: list[str]) -> int | None:
    """Return where a header has a name, as in logs: in any capitals, with a unit behind it."""
    if name in names:
        return names.index(name)
    plain = [_UNIT.sub("", each).strip().lower() for each in names]
    wanted = _UNIT.sub("", name).strip().lower()
    return plain.index(wanted) if plain.count(wanted) == 1 else None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
