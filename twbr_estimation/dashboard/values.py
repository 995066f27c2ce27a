"""Texts that a user types, to values of parameters and back."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import yaml

from ..errors import ConfigurationError
from .source import ParameterInfo

LONGEST = 60
"""Letters of a text that an error repeats."""


def text_of_value(value: Any) -> str:
    """Return a string as it is, and a list as in YAML on one line."""
    if isinstance(value, str):
        return value
    return str(yaml.safe_dump(value, default_flow_style=True, width=float("inf"))).strip()


def value_of_text(text: str, present: Any) -> Any:
    """Return the value that is meant by a text.

    Args:
        text: As typed.
        present: The value in force: a string, or a list, which has the form `[1.0, 2.0]`.

    Raises:
        ConfigurationError: a list is needed and the text is not one.
    """
    if isinstance(present, str):
        return text
    try:
        found = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        found = None
    if not isinstance(found, list):
        shown = text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
        raise ConfigurationError(f"{shown!r} is no list; write it as [1.0, 2.0]")
    numbers = [_number(each) for each in found]
    wanted = not any(isinstance(each, str) for each in present)
    if wanted and None not in numbers and any(not isinstance(each, int) for each in found):
        return numbers
    return found


def _number(value: Any) -> float | None:
    """Return a number; YAML reads 1e-3 as text."""
    if isinstance(value, bool):
        return None
    try:
        return float(value)
    except (ValueError, TypeError, OverflowError):
        return None


def whole(value: float) -> int:
    """Return a whole number as int.

    Raises:
        ConfigurationError: it has a fraction.
    """
    if value != round(value):
        raise ConfigurationError(f"{value:g} is no whole number")
    return round(value)


def settings_yaml(found: Iterable[ParameterInfo], filter_parameter: str = "filter") -> str:
    """Return the filter, its parameters and those of the correction as a ROS parameter file."""
    listed = list(found)
    by_name = {each.name: each.value for each in listed}
    filters = next((each.choices for each in listed if each.name == filter_parameter), ())
    owners = {*filters, "correction"}
    parameters: dict[str, Any] = {}
    for name in (filter_parameter, "settings_dt"):
        if by_name.get(name):
            parameters[name] = by_name[name]
    for name, value in by_name.items():
        owner, _, key = name.partition(".")
        if key and owner in owners and value != []:
            parameters.setdefault(owner, {})[key] = value
    return str(yaml.safe_dump({"/**": {"ros__parameters": parameters}}, sort_keys=False))
