"""Limits, unit and meaning of a number a user may set, and the check against them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from ..errors import ConfigurationError
from .argument_checks import as_number, elements_of, require_kind, shown


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

    def __post_init__(self) -> None:
        if not as_number(self.minimum) <= as_number(self.maximum):
            limits = f"{shown(self.minimum)}, {shown(self.maximum)}"
            raise ConfigurationError(f"`minimum`, `maximum`: {limits}: not a lower, higher number")
        require_kind("unit", self.unit, str, "a text")
        require_kind("description", self.description, str, "a text")


@dataclass(frozen=True, slots=True)
class Meaning:
    """Meaning of a switch, a name or a choice; the metadata of an `Annotated` field."""

    description: str


def within(name: str, value: object, bounds: Bounds) -> float:
    """Return `value` as a float, checked against `bounds`.

    Raises:
        ConfigurationError: not a finite number, or outside the bounds.
    """
    number = as_number(value)
    if math.isnan(number):
        raise ConfigurationError(f"{name}: {shown(value)} is not a number")
    if not math.isfinite(number) or not bounds.minimum <= number <= bounds.maximum:
        unit = "" if bounds.unit in ("", "1") else f" {bounds.unit}"
        limits = f"[{bounds.minimum:g}, {bounds.maximum:g}]{unit}"
        raise ConfigurationError(f"{name}: {shown(value)} is outside {limits}")
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


hints_of = cache(get_type_hints)
"""Types of the fields of a dataclass or named tuple, by name; resolved once."""


def require_bounds(settings: object, prefix: str = "") -> None:
    """Check the annotated fields of a dataclass, and give each the type that it declares.

    Args:
        settings: the instance; a list becomes a tuple, a number of numpy one of Python.
        prefix: put before the names in messages, such as `"robot."`.

    Raises:
        ConfigurationError: another type or length, not a finite number, or outside the bounds.
    """
    kind: Any = type(settings)
    hints = hints_of(kind)
    for name, annotation in annotations_of(kind).items():
        value = _settled(prefix + name, getattr(settings, name), hints[name], annotation)
        object.__setattr__(settings, name, value)


def _settled(name: str, value: Any, hint: Any, annotation: Bounds | Meaning) -> Any:
    """Return `value` as the type `hint`: number, switch, text, choice, or a tuple of one kind."""
    if hint is float and isinstance(annotation, Bounds):  # the most frequent first
        return within(name, value, annotation)
    if get_origin(hint) is tuple:
        return _elements(name, value, get_args(hint), annotation)
    if isinstance(annotation, Bounds):
        number = within(name, value, annotation)
        if number != int(number):
            raise ConfigurationError(f"{name}: {shown(value)} is no whole number")
        return int(number)
    if issubclass(hint, Enum):
        return _choice(name, value, hint)
    if hint is bool and getattr(getattr(value, "dtype", None), "kind", "") == "b":
        return bool(value)
    if not isinstance(value, hint):
        raise ConfigurationError(f"{name}: {shown(value)} is no {hint.__name__}")
    return value


def _elements(
    name: str, value: Any, kinds: tuple[Any, ...], annotation: Bounds | Meaning
) -> tuple[Any, ...]:
    """Return a sequence as a tuple whose elements are of these kinds."""
    elements = elements_of(value)
    length = None if Ellipsis in kinds else len(kinds)
    if elements is None or length not in (None, len(elements)):
        wanted = "values" if length is None else f"{length} values"
        raise ConfigurationError(f"{name}: {shown(value)}: {wanted} are needed, in a sequence")
    return tuple(_settled(name, each, kinds[0], annotation) for each in elements)


def _choice(name: str, value: object, kind: type[Enum]) -> Enum:
    try:
        return kind(value)
    except ValueError:
        known = ", ".join(str(member.value) for member in kind)
        raise ConfigurationError(f"{name}: {shown(value)} is not one of {known}") from None
