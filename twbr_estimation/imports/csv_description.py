"""The YAML file that describes the columns of a comma-separated log.

    columns:                    # names of the header row, or numbers counted from 0
      time: t_us                # or two, [date, time]
      arrival: pc_time          # when the computer received the row; for `stamps` below
      gyro: [gx, gy, gz]        # sensor axes x, y, z; null for an axis that was not logged
      accel: [ax, ay, az]
      wheels: [left, right]     # or one; optional, positive rolling forward
      wheel_speeds: [vl, vr]    # in place of `wheels`: integrated
      motors: [ul, ur]          # or one for both; optional, voltage at the motors
      estimates: {mine: pitch}  # tilt by the robot's own filters; optional, scored beside ours
      reference: encoder        # optional
      temperature: temp         # optional [degC]
    units:
      time: us                  # s, ms, us, ns; d for a spreadsheet's days, found if not given
                                # a date and time, a time of day, and the prefix
                                # `12:00:00.002 -> ` of a serial monitor need no unit
      gyro: deg/s               # rad/s, deg/s, or LSB with `lsb_per` below
      accel: g                  # m/s^2, g, or LSB
      wheels: counts            # rad, deg, or counts with `counts_per_turn`
      wheel_speeds: rpm         # rad/s, deg/s, rpm, counts/s with `counts_per_turn`, or m/s,
                                # mm/s with `robot.wheel_radius`
      motors: V                 # V, mV
      estimates: deg            # rad, deg
      reference: deg            # rad, deg, or counts
    lsb_per: {gyro: 131.0, accel: 16384.0}        # LSB per deg/s and per g
    counts_per_turn: {wheels: 1320, reference: 2000}
    signs: {accel: [1, 1, -1], wheels: [1, -1], reference: 1}    # 1 where not given
    axes: [x, y, z]             # which sensor axis is body forward, left, up; -y is opposed
    reference: {offset_deg: 0.0, delay: 0.0}
    rate: 100.0                 # samples per second [Hz], in place of a column of time
    stamps: header              # the column of time; arrival takes that of the arrival, device
                                # relates the time, of the board's own clock, to the arrival
    time_wrap: 4294967296       # counter of this size starts again at 0; found where not given
    wheel_wrap: 65536           # the same for the wheels' counts
    encoding: utf-16            # found where not given
    delimiter: ","              # found among , ; and tab where not given; " " is any blank
    decimal: "."                # "," in logs of spreadsheets that write 0,5; found if not given
    header: true
    skip_rows: 0
    robot: {wheel_radius: 0.034, encoder_placement: body}   # fields of `Robot`; optional

The reference is sign * column + offset. With a `delay` D [s] the reference in a row stamped t
belongs to t + D, as with `twbr evaluate --reference-delay D`.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.bounded_yaml import load_yaml
from ..errors import ConfigurationError
from ..recording import FloatArray
from ..robot import Robot
from ..samples import Stamps
from .csv_units import DIVISORS, UNITS

_SECTIONS = {
    "columns": UNITS.keys(),
    "units": UNITS.keys(),
    "lsb_per": {"gyro", "accel"},
    "counts_per_turn": {"wheels", "wheel_speeds", "reference"},
    "signs": UNITS.keys() - {"time", "arrival", "temperature", "estimates"},
    "reference": {"offset_deg", "delay"},
    "robot": None,
}
_VALUES = {
    "axes", "time_wrap", "wheel_wrap", "rate", "stamps", "encoding",
    "delimiter", "decimal", "header", "skip_rows",
}  # fmt: skip
_REQUIRED = ("gyro", "accel")
_LARGEST = 1e12
"""No rate, delay or size of a counter is as large."""
_AXES = {"x": 0, "y": 1, "z": 2}
MONITOR = "serial_monitor"
"""Name of the time that a serial monitor put before each line, where that is to be used."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column and how its numbers become SI units: scale * (number + offset)."""

    name: str | int | None
    """Header name or number from 0; None where the log has no such column."""
    scale: float
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Description:
    """Description of a log's columns."""

    time: Column | None
    """None where `rate` is given."""
    imu: tuple[Column, ...]
    """Gyro x, y, z, accelerometer x, y, z."""
    wheels: tuple[Column, ...] = ()
    wheel_speeds: tuple[Column, ...] = ()
    motors: tuple[Column, ...] = ()
    estimates: Mapping[str, tuple[Column, ...]] = field(default_factory=dict)
    """Column of each of the robot's own estimates by name."""
    reference: tuple[Column, ...] = ()
    temperature: tuple[Column, ...] = ()
    axes: FloatArray = field(default_factory=lambda: np.eye(3))
    """Body axes as rows in the sensor's axes, (3, 3)."""
    reference_delay: float = 0.0
    """Delay of the reference's stamps after those of its rows [s]."""
    arrival: Column | None = None
    """When the computer received a row, by its own clock, where `time` is a board's."""
    rate: float = 0.0
    """Samples per second [Hz] where there is no column of time."""
    time_has_unit: bool = False
    """Whether the unit of the time is given; seconds are the default."""
    time_wrap: float = 0.0
    wheel_wrap: float = 0.0
    encoding: str | None = None
    delimiter: str | None = None
    """None where it is to be found."""
    decimal: str | None = None
    """Sign between a number's whole part and its fraction; None where it is to be found."""
    date: Column | None = None
    """Column of the date where it is apart from the time's."""
    has_header: bool = True
    skip_rows: int = 0
    robot: Robot = field(default_factory=Robot)

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns."""
        times = (self.date, self.time, self.arrival)
        time = tuple(each for each in times if each is not None)
        several = (self.imu, self.wheels, self.wheel_speeds, self.motors, self.reference)
        listed = (*several, self.temperature, *self.estimates.values())
        return (*time, *(column for each in listed for column in each))

    @property
    def names(self) -> tuple[str, ...]:
        """Names that the header must have."""
        named = (each.name for each in self.columns if isinstance(each.name, str))
        return tuple(name for name in named if name != MONITOR)

    @property
    def fields(self) -> int:
        """Number of fields a row needs for the columns that are given by number."""
        numbers = (each.name for each in self.columns if isinstance(each.name, int))
        return 1 + max(numbers, default=-1)


def read_description(path: Path) -> Description:
    """Read and check a description.

    Raises:
        ConfigurationError: unreadable, an unknown key or unit, or a missing column.
    """
    content = load_yaml(path, ConfigurationError)
    try:
        return _Reader(content).description()
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from None
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ConfigurationError(f"{path}: a value of the wrong kind: {error}") from error


class _Reader:
    """The content of one file, checked on the way out."""

    def __init__(self, content: Any) -> None:
        if not isinstance(content, dict) or "columns" not in content:
            raise ConfigurationError("needs a section `columns`")
        self.content: dict[str, Any] = content
        for key, value in content.items():
            if key not in _SECTIONS and key not in _VALUES:
                raise ConfigurationError(f"unknown key {key!r}")
            known = _SECTIONS.get(key)
            if known is None:
                continue
            if not isinstance(value, dict):
                raise ConfigurationError(f"{key}: {value!r} is no mapping of names to values")
            for name in value:
                if name not in known:
                    raise ConfigurationError(f"{key}: unknown key {name!r}; known: {_list(known)}")

    def description(self) -> Description:
        """Return the checked description."""
        content, reference = self.content, self.content.get("reference", {})
        offset = math.radians(self._number(reference.get("offset_deg", 0.0), "offset_deg"))
        rate = self._number(content.get("rate", 0.0), "rate", least=0.0)
        stamps = self._stamps()
        has_time = "time" in content["columns"] or stamps is Stamps.ARRIVAL
        self._require_one_of("rate", rate > 0.0, "columns.time", has_time)
        speeds = self._columns("wheel_speeds", 1, 2)
        if speeds and "wheels" in content["columns"]:
            raise ConfigurationError("columns: wheels and wheel_speeds exclude each other")
        arrival = self._arrival(stamps)
        when = () if rate else arrival if stamps is Stamps.ARRIVAL else self._columns("time", 1, 2)
        role = "arrival" if stamps is Stamps.ARRIVAL else "time"
        return Description(
            time=when[-1] if when else None,
            imu=(*self._columns("gyro", 3, 3), *self._columns("accel", 3, 3)),
            wheels=self._columns("wheels", 1, 2),
            wheel_speeds=speeds,
            motors=self._columns("motors", 1, 2),
            estimates=self._estimates(),
            reference=self._columns("reference", 1, 1, offset),
            temperature=self._columns("temperature", 1, 1),
            axes=_axes(content.get("axes", ["x", "y", "z"])),
            reference_delay=self._number(reference.get("delay", 0.0), "reference.delay"),
            arrival=arrival[0] if stamps is Stamps.DEVICE else None,
            rate=rate,
            time_has_unit=role in content.get("units", {}),
            time_wrap=self._number(content.get("time_wrap", 0.0), "time_wrap", least=0.0),
            wheel_wrap=self._number(content.get("wheel_wrap", 0.0), "wheel_wrap", least=0.0),
            encoding=_encoding(content.get("encoding")),
            delimiter=self._character("delimiter", None),
            decimal=self._character("decimal", None),
            date=when[0] if len(when) > 1 else None,
            has_header=bool(content.get("header", True)),
            skip_rows=int(self._number(content.get("skip_rows", 0), "skip_rows", least=0.0)),
            robot=_robot(content.get("robot", {})),
        )

    def _stamps(self) -> Stamps:
        given = self.content.get("stamps", Stamps.HEADER.value)
        known = [each.value for each in Stamps]
        if given not in known:
            raise ConfigurationError(f"stamps: {given!r}; known: {_list(known)}")
        return Stamps(given)

    def _arrival(self, stamps: Stamps) -> tuple[Column, ...]:
        """Return the column of the arrival, by default the times of a serial monitor."""
        if stamps is Stamps.HEADER:
            return ()
        return self._columns("arrival", 1, 1) or (Column(MONITOR, self._scale("arrival")),)

    def _require_one_of(self, one: str, is_one: bool, other: str, is_other: bool) -> None:
        if is_one == is_other:
            what = "exclude each other" if is_one else "are both missing"
            raise ConfigurationError(f"{other} and {one} {what}; one of them is needed")

    def _number(self, given: Any, key: str, least: float = -_LARGEST) -> float:
        try:
            value = float(given)
        except (TypeError, ValueError):
            raise ConfigurationError(f"{key}: {given!r} is no number") from None
        if not least <= value <= _LARGEST:
            raise ConfigurationError(f"{key}: {value:g} is not within {least:g} to {_LARGEST:g}")
        return value

    def _estimates(self) -> dict[str, tuple[Column, ...]]:
        given = self.content["columns"].get("estimates") or {}
        if not isinstance(given, dict):
            raise ConfigurationError(f"columns.estimates: {given!r} is no mapping NAME: COLUMN")
        for name in given:
            if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", str(name)):
                raise ConfigurationError(f"columns.estimates: {name!r} is no name of a topic")
        scale = self._scale("estimates")
        return {str(name): (Column(column, scale),) for name, column in given.items()}

    def _character(self, key: str, default: str | None) -> str | None:
        if key not in self.content:
            return default
        given = str(self.content[key])
        if len(given) != 1:
            raise ConfigurationError(f"{key}: {given!r} is not one character")
        return given

    def _columns(self, role: str, least: int, most: int, offset: float = 0.0) -> tuple[Column, ...]:
        """Return the columns of a role, none where it may be absent; `offset` in SI units."""
        names = _as_list(self.content["columns"].get(role))
        if not names and role not in _REQUIRED:
            return ()
        if not least <= len(names) <= most:
            raise ConfigurationError(
                f"columns.{role}: {len(names)} given, {least} to {most} are needed"
            )
        for name in names:
            if isinstance(name, int) and name < 0:
                raise ConfigurationError(f"columns.{role}: {name} is below 0, the first column")
        signs = _as_list(self.content.get("signs", {}).get(role)) or [1] * len(names)
        if len(signs) != len(names) or any(sign not in (1, -1) for sign in signs):
            raise ConfigurationError(f"signs.{role}: {signs}; needed is 1 or -1 for each column")
        scales = [sign * self._scale(role) for sign in signs]
        return tuple(
            Column(name, scale, offset / scale) for name, scale in zip(names, scales, strict=True)
        )

    def _scale(self, role: str) -> float:
        default = next(iter(UNITS[role]))
        unit = self.content.get("units", {}).get(role, default)
        if unit not in UNITS[role]:
            raise ConfigurationError(f"units.{role}: {unit!r}; known: {_list(UNITS[role])}")
        if role == "wheel_speeds" and unit in ("m/s", "mm/s"):
            return UNITS[role][unit] / _robot(self.content.get("robot", {})).wheel_radius
        if unit not in DIVISORS:
            return UNITS[role][unit]
        section = DIVISORS[unit]
        given = self.content.get(section, {}).get(role, 0.0)
        divisor = self._number(given, f"{section}.{role}")
        if not 0.0 < divisor < _LARGEST:
            raise ConfigurationError(f"{section}.{role} must be above 0 for unit {unit}")
        return UNITS[role][unit] / divisor


def _as_list(given: Any) -> list[Any]:
    """Return a YAML value that may be one thing, several or absent."""
    if given is None:
        return []
    return given if isinstance(given, list) else [given]


def _axes(given: Any) -> FloatArray:
    """Return body axes as rows in sensor axes from, for example, [-y, x, z]."""
    rows = np.zeros((3, 3))
    for row, text in enumerate(given):
        axis = str(text).lstrip("+-")
        if row > 2 or axis not in _AXES:
            raise ConfigurationError(f"axes: {given} are not three of x, y, z, each with a sign")
        rows[row, _AXES[axis]] = -1.0 if str(text).startswith("-") else 1.0
    if not np.isclose(np.linalg.det(rows), 1.0):
        raise ConfigurationError(f"axes: {given} are not a right-handed set of axes")
    return rows


def _encoding(given: Any) -> str | None:
    if given is None:
        return None
    try:
        return codecs.lookup(str(given)).name
    except LookupError:
        raise ConfigurationError(f"encoding: {given!r} is unknown; utf-8 is usual") from None


def _robot(given: Mapping[str, Any]) -> Robot:
    known = Robot.__dataclass_fields__
    for name in given:
        if name not in known:
            raise ConfigurationError(f"robot: unknown key {name!r}; known: {_list(known)}")
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in given.items()
    }
    return Robot(**values)


def _list(names: Any) -> str:
    return ", ".join(sorted(names))
