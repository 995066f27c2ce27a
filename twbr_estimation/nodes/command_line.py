"""The command line of a node: parameter files read before rcl does, whose errors name no line.

rcl refuses a list of whole numbers and fractions, as in `[0, 0, 0.135]`; here such a list is one of
numbers, as for the command line of `twbr`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from ..configuration.ros_yaml import PARAMETERS, read_yaml
from ..errors import ConfigurationError

ROS_ARGUMENTS = "--ros-args"
FILE_FLAG = "--params-file"
VALUE_FLAGS = ("-p", "--param")


class ParameterFile(NamedTuple):
    """One parameter file of the command line."""

    path: Path
    nodes: tuple[str, ...]
    """Names of the nodes it is for, patterns such as `/**` among them."""


class CommandLine(NamedTuple):
    """Arguments for rcl."""

    arguments: list[str]
    files: tuple[ParameterFile, ...]


def prepared(arguments: list[str], folder: Path) -> CommandLine:
    """Return the arguments for rcl and the parameter files in them.

    Args:
        arguments: As the process got them.
        folder: Takes files whose lists had to be rewritten.

    Raises:
        ConfigurationError: a parameter file that cannot be read or is not a ROS parameter file.
    """
    found, files = list(arguments), []
    for index in _ros_values(found):
        flag, text = found[index - 1], found[index]
        if flag == FILE_FLAG:
            content = _content(Path(text))
            files.append(ParameterFile(Path(text), tuple(_node_names(content))))
            if _mixed(content):
                found[index] = _rewritten(content, folder, index)
        elif flag in VALUE_FLAGS:
            found[index] = _with_numbers(text)
    return CommandLine(found, tuple(files))


def _ros_values(arguments: list[str]) -> Iterator[int]:
    """Yield where the values of flags lie between `--ros-args` and `--`."""
    inside = False
    for index, each in enumerate(arguments):
        if each in (ROS_ARGUMENTS, "--"):
            inside = each == ROS_ARGUMENTS
        elif inside and index > 0 and arguments[index - 1] in (FILE_FLAG, *VALUE_FLAGS):
            yield index


def _content(path: Path) -> dict[str, Any]:
    content = read_yaml(path)
    if not isinstance(content, dict) or not all(isinstance(each, str) for each in content):
        raise ConfigurationError(f"{path}: a parameter file maps node names to {PARAMETERS}")
    if not list(_node_names(content)):
        raise ConfigurationError(f"{path}: no node in it has {PARAMETERS}")
    if (found := _nested(content)) is not None:
        raise ConfigurationError(f"{path}: {found}: a list within a list is no parameter")
    return content


def _nested(value: Any, name: str = "") -> str | None:
    """Return the name of an entry whose list holds lists or mappings, which rcl would flatten."""
    if isinstance(value, list):
        return name if any(isinstance(each, (list, dict)) for each in value) else None
    if isinstance(value, dict):
        inside = (_nested(each, f"{name}.{key}".lstrip(".")) for key, each in value.items())
        return next((found for found in inside if found is not None), None)
    return None


def _node_names(content: dict[str, Any], prefix: str = "") -> Iterator[str]:
    """Yield the full names of nodes; namespaces may be nested."""
    for name, body in content.items():
        if isinstance(body, dict):
            path = f"{prefix.rstrip('/')}/{str(name).lstrip('/')}" if prefix else str(name)
            if PARAMETERS in body:
                yield path
            else:
                yield from _node_names(body, path)


def _mixed(value: Any) -> bool:
    """Whether a list of whole numbers and fractions is anywhere in it."""
    if isinstance(value, dict):
        return any(map(_mixed, value.values()))
    return isinstance(value, list) and {type(each) for each in value} == {int, float}


def _numbers(value: Any) -> Any:
    """Return the same with the numbers of each such list as fractions."""
    if isinstance(value, dict):
        return {name: _numbers(each) for name, each in value.items()}
    return [float(each) for each in value] if _mixed(value) else value


def _rewritten(content: dict[str, Any], folder: Path, number: int) -> str:
    path = folder / f"parameters_{number}.yaml"
    path.write_text(yaml.safe_dump(_numbers(content), sort_keys=False), encoding="utf-8")
    return str(path)


def _with_numbers(assignment: str) -> str:
    name, separator, text = assignment.partition(":=")
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        return assignment  # rcl reports what is wrong with it
    return f"{name}{separator}{_numbers(value)}" if _mixed(value) else assignment


def temporary_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder for rewritten files that goes with the block it is opened in."""
    return tempfile.TemporaryDirectory(prefix="twbr_parameters_")
