"""ROS parameter files: `NODE: {ros__parameters: {...}}` as flat, dotted names and back.

This module has the syntax only; what the names mean is in `files`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_origin

import yaml

from ..disk.bounded_yaml import load_yaml
from ..disk.reading import exists
from ..disk.writing import write_text
from ..errors import ConfigurationError

ANY_NODE = "/**"
"""The node name that stands for every node."""
PARAMETERS = "ros__parameters"


class Entry(NamedTuple):
    """One parameter as a file gives it."""

    name: str
    """Full name with dots, as in `robot.wheel_radius`."""
    value: Any
    path: Path
    for_any_node: bool
    """Whether it stands under `/**`, not under one node's name."""


def read_yaml(path: Path) -> Any:
    """Return what a YAML file holds.

    Raises:
        ConfigurationError: no such file, no valid YAML, or beyond the limits of `load_yaml`.
    """
    return load_yaml(path, ConfigurationError)


def read_parameters(path: Path) -> tuple[Entry, ...]:
    """Return the parameters of one file in the order of the file.

    Raises:
        ConfigurationError: no such file, no valid YAML, or not of the form of ROS.
    """
    content = read_yaml(path)
    found = []
    for node, body in _mapping(path, "the file", content).items():
        if not isinstance(body, dict) or set(body) != {PARAMETERS}:
            raise ConfigurationError(
                f"{path}: {node!r} must hold {PARAMETERS!r} alone, as in a ROS parameter file"
            )
        parameters = _mapping(path, f"{node}.{PARAMETERS}", body[PARAMETERS])
        found += [Entry(name, value, path, node == ANY_NODE) for name, value in flat(parameters)]
    return tuple(found)


def write_parameters(
    path: Path, parameters: Mapping[str, Any], header: str, replace: bool = False
) -> None:
    """Write nested parameters for every node, the file complete or not at all.

    Args:
        path: File to write; its folder is made where it is missing.
        parameters: Nested mappings of bool, int, float, str and lists of them.
        header: Comment for the top of the file.
        replace: Whether an existing file may be replaced.

    Raises:
        ConfigurationError: the file exists and `replace` is not set.
        WritingError: it cannot be written.
    """
    if exists(path) and not replace:
        raise ConfigurationError(f"{path}: exists already and was not to be replaced")
    write_text(path, parameters_text(parameters, header))


def parameters_text(parameters: Mapping[str, Any], header: str) -> str:
    """Return the text of a parameter file; arguments as `write_parameters`."""
    body = yaml.safe_dump({ANY_NODE: {PARAMETERS: parameters}}, sort_keys=False, width=95)
    return "".join(f"# {line}\n" for line in header.splitlines()) + body


def converted(entry: Entry, hint: Any) -> Any:
    """Return an entry's value as the type a field declares: bool, float, enum or tuple of floats.

    Raises:
        ConfigurationError: another type, another length, or not finite.
    """
    if hint is bool:
        if not isinstance(entry.value, bool):
            raise ConfigurationError(f"{entry.path}: {entry.name}: {entry.value!r} is no bool")
        return entry.value
    if isinstance(hint, type) and issubclass(hint, Enum):
        choices = [member.value for member in hint]
        if entry.value not in choices:
            raise ConfigurationError(
                f"{entry.path}: {entry.name}: {entry.value!r} is not one of {', '.join(choices)}"
            )
        return hint(entry.value)
    if get_origin(hint) is tuple:
        return _numbers(entry, get_args(hint))
    return number(entry)


def _numbers(entry: Entry, wanted: tuple[Any, ...]) -> tuple[float, ...]:
    value = entry.value
    if not isinstance(value, list) or (Ellipsis not in wanted and len(value) != len(wanted)):
        amount = "a list of" if Ellipsis in wanted else f"a list of {len(wanted)}"
        raise ConfigurationError(f"{entry.path}: {entry.name}: {value!r} is not {amount} numbers")
    return tuple(_finite(entry, element) for element in value)


def number(entry: Entry) -> float:
    """Return an entry's value as a finite number.

    Raises:
        ConfigurationError: another type, or not finite.
    """
    return _finite(entry, entry.value)


def _finite(entry: Entry, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ConfigurationError(f"{entry.path}: {entry.name}: {value!r} is not a number")
    if not math.isfinite(value):
        raise ConfigurationError(f"{entry.path}: {entry.name}: {value} is not finite")
    return float(value)


def _mapping(path: Path, name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise ConfigurationError(f"{path}: {name} must be a mapping of names to values")
    return value


def flat(parameters: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the full names of nested parameters, and their values."""
    for name, value in parameters.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
