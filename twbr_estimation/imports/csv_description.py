"""The YAML file that says what the columns of a comma-separated log are.

    columns:                    # names of the header row, or numbers counted from 0
      time: t_us
      gyro: [gx, gy, gz]        # sensor axes x, y, z; null for an axis that was not logged
      accel: [ax, ay, az]
      wheels: [left, right]     # or one; optional, positive rolling forward
      reference: encoder        # optional
      temperature: temp         # optional [degC]
    units:
      time: us                  # s, ms, us, ns
      gyro: deg/s               # rad/s, deg/s, or LSB with `lsb_per` below
      accel: g                  # m/s^2, g, or LSB
      wheels: counts            # rad, deg, or counts with `counts_per_turn`
      reference: deg            # rad, deg, or counts
    lsb_per: {gyro: 131.0, accel: 16384.0}        # LSB per deg/s and per g
    counts_per_turn: {wheels: 1320, reference: 2000}
    signs: {accel: [1, 1, -1], wheels: [1, -1], reference: 1}    # 1 where not given
    axes: [x, y, z]             # which sensor axis is body forward, left, up; -y is opposed
    reference: {offset_deg: 0.0, delay: 0.0}
    time_wrap: 4294967296       # counter of this size starts again at 0; optional
    delimiter: ","
    decimal: "."                # "," in logs of spreadsheets that write 0,5
    header: true
    skip_rows: 0
    robot: {wheel_radius: 0.034, encoder_placement: body}   # fields of `Robot`; optional

The reference is sign * column + offset. With a `delay` D [s] the reference in a row stamped t
belongs to t + D, as with `twbr evaluate --reference-delay D`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ..errors import ConfigurationError
from ..recording import FloatArray
from ..robot import Robot
from ..samples import STANDARD_GRAVITY

_UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "gyro": {"rad/s": 1.0, "deg/s": math.radians(1.0), "LSB": math.radians(1.0)},
    "accel": {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "LSB": STANDARD_GRAVITY},
    "wheels": {"rad": 1.0, "deg": math.radians(1.0), "counts": 2.0 * math.pi},
    "reference": {"rad": 1.0, "deg": math.radians(1.0), "counts": 2.0 * math.pi},
    "temperature": {"degC": 1.0},
}
_DIVISORS = {"LSB": "lsb_per", "counts": "counts_per_turn"}
_SECTIONS = {
    "columns": _UNITS.keys(),
    "units": _UNITS.keys(),
    "lsb_per": {"gyro", "accel"},
    "counts_per_turn": {"wheels", "reference"},
    "signs": {"gyro", "accel", "wheels", "reference"},
    "reference": {"offset_deg", "delay"},
    "robot": None,
}
_VALUES = {"axes", "time_wrap", "delimiter", "decimal", "header", "skip_rows"}
_REQUIRED = ("time", "gyro", "accel")
_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class Column:
    """One column and how its numbers become SI units: scale * (number + offset)."""

    name: str | int | None
    """Header name or number from 0; None where the log has no such column."""
    scale: float
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Description:
    """What a log's columns are."""

    time: Column
    imu: tuple[Column, ...]
    """Gyro x, y, z, accelerometer x, y, z."""
    wheels: tuple[Column, ...] = ()
    reference: tuple[Column, ...] = ()
    temperature: tuple[Column, ...] = ()
    axes: FloatArray = field(default_factory=lambda: np.eye(3))
    """Body axes as rows in the sensor's axes, (3, 3)."""
    reference_delay: float = 0.0
    """How much later the reference's stamps are than its rows' [s]."""
    time_wrap: float = 0.0
    delimiter: str = ","
    decimal: str = "."
    """Sign between a number's whole part and its fraction."""
    has_header: bool = True
    skip_rows: int = 0
    robot: Robot = field(default_factory=Robot)


def read_description(path: Path) -> Description:
    """Read and check a description.

    Raises:
        ConfigurationError: unreadable, an unknown key or unit, or a missing column.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigurationError(f"{path}: cannot be read: {error}") from error
    try:
        return _Reader(content).description()
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from None
    except (TypeError, ValueError) as error:
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
            for name in value:
                if name not in known:
                    raise ConfigurationError(f"{key}: unknown key {name!r}; known: {_list(known)}")

    def description(self) -> Description:
        """Return the checked description."""
        content, reference = self.content, self.content.get("reference", {})
        offset = math.radians(float(reference.get("offset_deg", 0.0)))
        return Description(
            time=self._columns("time", 1, 1)[0],
            imu=(*self._columns("gyro", 3, 3), *self._columns("accel", 3, 3)),
            wheels=self._columns("wheels", 1, 2),
            reference=self._columns("reference", 1, 1, offset),
            temperature=self._columns("temperature", 1, 1),
            axes=_axes(content.get("axes", ["x", "y", "z"])),
            reference_delay=float(reference.get("delay", 0.0)),
            time_wrap=float(content.get("time_wrap", 0.0)),
            delimiter=self._character("delimiter", ","),
            decimal=self._character("decimal", "."),
            has_header=bool(content.get("header", True)),
            skip_rows=int(content.get("skip_rows", 0)),
            robot=_robot(content.get("robot", {})),
        )

    def _character(self, key: str, default: str) -> str:
        given = str(self.content.get(key, default))
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
        default = next(iter(_UNITS[role]))
        unit = self.content.get("units", {}).get(role, default)
        if unit not in _UNITS[role]:
            raise ConfigurationError(f"units.{role}: {unit!r}; known: {_list(_UNITS[role])}")
        if unit not in _DIVISORS:
            return _UNITS[role][unit]
        section = _DIVISORS[unit]
        divisor = float(self.content.get(section, {}).get(role, 0.0))
        if not divisor > 0.0:
            raise ConfigurationError(f"{section}.{role} must be above 0 for unit {unit}")
        return _UNITS[role][unit] / divisor


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
