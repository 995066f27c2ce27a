"""Checks of what a caller passes: the errors name the argument, the value and what is wanted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Set
from typing import Any

from ..errors import ConfigurationError

_LONGEST = 80
"""Characters of a value that a message shows."""


def as_number(value: object) -> float:
    """Return a real number of any type as a float; NaN for a switch, a text, an array."""
    if type(value) is float:
        return value
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    dimensions: int = getattr(value, "ndim", 0)
    if isinstance(value, (bool, str, bytes)) or kind not in "iuf" or dimensions:
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf
    except (TypeError, ValueError):
        return math.nan


def shown(value: object) -> str:
    """Return a value for a message: its `repr` on one line, cut where it is long."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of thousands of digits
        text = f"a {type(value).__name__}"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def elements_of(value: Any) -> tuple[Any, ...] | None:
    """Return what a sequence or an array holds; None of all else, a text or a set among it."""
    if type(value) in (tuple, list):  # the usual, sample by sample
        return tuple(value)
    if isinstance(value, (str, bytes, Mapping, Set)) or not isinstance(value, Iterable):
        return None
    try:
        return tuple(value)
    except TypeError:  # an array without a dimension
        return None


def require_kind(argument: str, value: object, kinds: Any, wanted: str) -> None:
    """Raise where an argument is of no kind that can be used.

    Args:
        argument: its name.
        value: what was passed.
        kinds: a class, or several as for `isinstance`.
        wanted: what is needed, in words: `a Recording`.

    Raises:
        ConfigurationError: `value` is no instance.
    """
    if not isinstance(value, kinds):
        raise ConfigurationError(f"`{argument}`: {shown(value)} is not {wanted}")


def require_names(argument: str, value: object) -> tuple[str, ...]:
    """Return one text, or a sequence of them, as a tuple.

    Raises:
        ConfigurationError: neither.
    """
    names = (value,) if isinstance(value, str) else elements_of(value)
    if names is None or not all(isinstance(name, str) for name in names):
        raise ConfigurationError(f"`{argument}`: {shown(value)} is no sequence of texts")
    return names


def require_callable(argument: str, value: object) -> None:
    """Raise where an argument cannot be called.

    Raises:
        ConfigurationError: it is no function.
    """
    if not callable(value):
        raise ConfigurationError(f"`{argument}`: {shown(value)} is no function")


def number_within(argument: str, value: object, low: float, high: float, unit: str) -> float:
    """Return a number of any type as a float, within limits.

    Raises:
        ConfigurationError: it is no number, or outside.
    """
    number = as_number(value)
    if not low <= number <= high:
        raise ConfigurationError(
            f"`{argument}`: {shown(value)} is no number from {low:g} to {high:g} {unit}".rstrip()
        )
    return number


def whole_number(argument: str, value: object, low: int, high: int) -> int:
    """Return an integer of any type as an int, within limits.

    Raises:
        ConfigurationError: it is no integer, or outside.
    """
    number = as_number(value)
    if not hasattr(value, "__index__") or not low <= number <= high:
        raise ConfigurationError(
            f"`{argument}`: {shown(value)} is no whole number from {low} to {high}"
        )
    return int(value)
