"""Limits, unit and meaning of a number a user may set, and the check against them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, get_type_hints

from ..errors import ConfigurationError


@dataclass(frozen=True, slots=True)
class Bounds:
    """Limits, unit and meaning of one parameter; the metadata of an `Annotated` field."""

    minimum: float
    maximum: float
    unit: str
    description: str
    logarithmic: bool = False
    """True where a tuner should search the logarithm; it needs a floor where `minimum` is 0."""
    tunable: bool = True
    """False where a tuner leaves the value alone: switches, initial values, common scales."""
    historical: bool = False
    """True for what only a reproduction sets; no node declares it."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """Meaning of a switch, a name or a choice; the metadata of an `Annotated` field."""

    description: str


def within(name: str, value: object, bounds: Bounds) -> float:
    """Return `value` as a float, checked against `bounds`.

    Raises:
        ConfigurationError: not a finite number, or outside the bounds.
    """
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ConfigurationError(f"{name}: {value!r} is not a number") from None
    if not math.isfinite(number) or not bounds.minimum <= number <= bounds.maximum:
        raise ConfigurationError(
            f"{name}: {value!r} is outside [{bounds.minimum:g}, {bounds.maximum:g}] {bounds.unit}"
        )
    return number


@cache
def annotations_of(kind: type[Any]) -> Mapping[str, Bounds | Meaning]:
    """Return the annotations of the fields of a dataclass or named tuple, by name."""
    found: dict[str, Bounds | Meaning] = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        for extra in getattr(hint, "__metadata__", ()):
            if isinstance(extra, (Bounds, Meaning)):
                found[name] = extra
    return found


def require_bounds(settings: object, prefix: str = "") -> None:
    """Check every bounded field of a dataclass; arrays element by element.

    Args:
        settings: the instance.
        prefix: put before the names in messages, such as `"robot."`.

    Raises:
        ConfigurationError: not a finite number, or outside the bounds.
    """
    kind: Any = type(settings)
    for name, bounds in annotations_of(kind).items():
        if not isinstance(bounds, Bounds):
            continue
        value = getattr(settings, name)
        for element in value if isinstance(value, (tuple, list)) else (value,):
            within(prefix + name, element, bounds)
