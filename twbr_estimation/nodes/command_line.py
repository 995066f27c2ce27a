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

from ..configuration.ros_yaml import ANY_NODE, PARAMETERS, flat, read_yaml
from ..errors import ConfigurationError

ROS_ARGUMENTS = "--ros-args"
FILE_FLAG = "--params-file"
VALUE_FLAGS = ("-p", "--param")
OF_RCLPY = {
    "use_sim_time": "true or false",
    "start_type_description_service": "true or false",
    "qos_overrides.": "a number or a word",
}
"""What the parameters that rclpy declares itself must be, by how their names begin."""


class ParameterFile(NamedTuple):
    """One parameter file of the command line."""

    path: Path
    nodes: tuple[str, ...]
    """Names of the nodes it is for, patterns such as `/**` among them."""


class Given(NamedTuple):
    """One parameter that the command line or a file of it gives."""

    name: str
    value: Any
    node: str
    """Name of the nodes it is for, as in a file."""
    path: Path | None = None
    """The file; None for one of the command line itself."""


class CommandLine(NamedTuple):
    """Arguments for rcl."""

    arguments: list[str]
    files: tuple[ParameterFile, ...]
    given: tuple[Given, ...]
    """The parameters in their order; for a node, the last of a name holds."""

    def origin(self, name: str) -> Path | None:
        """Return the file that gives a node its parameter; None for no file, or if in doubt."""
        found = [each for each in self.given if each.name == name]
        if len({each.path for each in found}) == 1 or (found and found[-1].node == ANY_NODE):
            return found[-1].path
        return None

    def located(self, problem: str) -> str:
        """Return a message with the file of the parameter that it begins or ends with."""
        names = problem.partition(": ")[0], problem.rpartition(": ")[2]
        path = next(filter(None, map(self.origin, names)), None)
        return f"{path}: {problem}" if path else problem


def prepared(arguments: list[str], folder: Path) -> CommandLine:
    """Return the arguments for rcl and the parameter files in them.

    Args:
        arguments: As the process got them.
        folder: Takes files whose lists had to be rewritten.

    Raises:
        ConfigurationError: a parameter file that cannot be read or is not a ROS parameter file,
            or an empty list that rclpy would not survive.
    """
    found, files, given = list(arguments), [], list[Given]()
    for index in _ros_values(found):
        flag, text = found[index - 1], found[index]
        if flag == FILE_FLAG:
            content = _content(Path(text))
            sections = dict(_sections(content))
            files.append(ParameterFile(Path(text), tuple(sections)))
            for node, parameters in sections.items():
                if isinstance(parameters, dict):  # otherwise rcl says what is wrong
                    given += [Given(*each, node, Path(text)) for each in flat(parameters)]
            if _mixed(content):
                found[index] = _rewritten(content, folder, index)
        elif flag in VALUE_FLAGS and (one := _assigned(text)) is not None:
            given.append(one)
            if _mixed(one.value):
                found[index] = f"{text.partition(':=')[0]}:={_numbers(one.value)}"
    line = CommandLine(found, tuple(files), tuple(given))
    for each in given:
        for start, needed in OF_RCLPY.items():
            if each.value == [] and each.name.startswith(start):
                problem = f"{each.name}: [] is of the wrong type; needed is {needed}"
                raise ConfigurationError(line.located(problem))
    return line


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
    if not list(_sections(content)):
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


def _sections(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the full names of nodes and their parameters; namespaces may be nested."""
    for name, body in content.items():
        if isinstance(body, dict):
            path = f"{prefix.rstrip('/')}/{str(name).lstrip('/')}" if prefix else str(name)
            if PARAMETERS in body:
                yield path, body[PARAMETERS]
            else:
                yield from _sections(body, path)


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


def _assigned(assignment: str) -> Given | None:
    """Return what `NAME:=VALUE` or `NODE:NAME:=VALUE` gives; None for what rcl refuses."""
    name, _, text = assignment.partition(":=")
    node, _, name = name.rpartition(":")
    try:
        return Given(name, yaml.safe_load(text), node or ANY_NODE)
    except (yaml.YAMLError, ValueError):
        return None


def temporary_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder for rewritten files that goes with the block it is opened in."""
    return tempfile.TemporaryDirectory(prefix="twbr_parameters_")
