"""Messages at the start: the reason why rcl refuses, and parameters that no node uses."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import fields
from difflib import get_close_matches
from functools import cache
from pathlib import Path

from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    InvalidServiceNameException,
    InvalidTopicNameException,
)
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from ..robot import Robot
from .command_line import OF_RCLPY, ParameterFile
from .parameter_requests import PROVENANCE, unknown

REFUSED = (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    InvalidServiceNameException,
    InvalidTopicNameException,
    rclpy_implementation.RCLError,
)
"""Errors of rclpy while a node is created that the command line causes."""
HINTS = {
    "log directory": "set ROS_LOG_DIR to a folder that can be written",
    "logging directory": "set HOME or ROS_LOG_DIR; a service at boot often has neither",
    "ROS_DOMAIN_ID": "set ROS_DOMAIN_ID to a whole number from 0 to 101",
    "remap rule": "a remapping has the form FROM:=TO, with names of letters, digits and _",
    "parameter override rule": "a parameter has the form NAME:=VALUE, as in filter:=kalman",
    "params file": "check its form: NODE or /**, ros__parameters, then names and values",
    "UnknownROSArgsError": "after --ros-args come -p, -r and --params-file",
    "participant": "check ROS_DOMAIN_ID (0 to 101) and the network",
}
"""Remedy, by a word in rcl's message."""
_PLACE = re.compile(r", at /\S+:\d+")
_NAMES = re.compile(
    r"^    (?:(\w+): (?:Annotated\[|\w+ = field)|name=\"(\w+)\")"
    r"|(?:Declaration\(|declarations_of\(\w+,)\s*\"(\w+)",
    re.MULTILINE,
)
"""What begins the name of a parameter, where it is defined."""
UNDECLARED = (*OF_RCLPY, PROVENANCE)
"""Beginnings of the names that no node of this package declares and that may be given."""


def refusal(error: BaseException) -> str:
    """Return what rcl refuses at the start, in one line with what to change."""
    text = _PLACE.sub("", " ".join(str(error).split()))
    known = f"{type(error).__name__} {text}"
    hints = [hint for word, hint in HINTS.items() if word in known]
    return f"cannot start: {text}{'; ' + hints[0] if hints else ''}"


def start_warnings(nodes: Sequence[Node], files: Sequence[ParameterFile]) -> Iterator[str]:
    """Yield a sentence for each parameter and each parameter file that no node takes.

    Args:
        nodes: All nodes of the process, their parameters declared.
        files: The parameter files of the command line.
    """
    own = [node.get_fully_qualified_name() for node in nodes]
    for file in files:
        strangers = [each for each in file.nodes if not any(applies(each, name) for name in own)]
        if len(strangers) == len(file.nodes) or any(_misspelt(each) for each in strangers):
            yield _for_others(file, strangers, own)
    declared = {name for node in nodes for name in node.list_parameters([], 0).names}
    given = {name: node for node in nodes for name in node._parameter_overrides}
    for name, node in given.items():
        if name not in declared and not name.startswith(UNDECLARED) and _nobodys(name, declared):
            yield f"not used: {unknown(name, node)}"


def applies(pattern: str, name: str) -> bool:
    """Whether a name in a parameter file, such as `/**/filter_node`, is that of a node.

    Args:
        pattern: With `*` for one part of the name and `**` for any number of parts.
        name: Of a node, with its namespace.
    """
    parts = pattern.strip("/").split("/")
    expression = "".join(
        {"**": "(/[^/]+)*", "*": "/[^/]+"}.get(p, f"/{re.escape(p)}") for p in parts
    )
    return re.fullmatch(expression, name) is not None


def _for_others(file: ParameterFile, strangers: list[str], own: list[str]) -> str:
    wrong = [each for each in strangers if _misspelt(each)] or strangers
    close = get_close_matches(_last(wrong[0]), [*map(_last, own), *_executables()], 1)
    hint = f"; is {close[0]} meant?" if close and close[0] != _last(wrong[0]) else ""
    return (
        f"{file.path}: what stands under {', '.join(wrong)} is not used: "
        f"this is {', '.join(map(_last, own))}{hint}"
    )


def _misspelt(pattern: str) -> bool:
    """Whether a name in a file resembles that of a node of this package without being one."""
    name, known = _last(pattern), _executables()
    return name not in known and bool(get_close_matches(name, known, 1, 0.85))


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _nobodys(name: str, declared: set[str]) -> bool:
    """Whether no node of this package has a parameter of this name."""
    owner, _, rest = name.partition(".")
    if any(each.startswith(f"{owner}.") for each in declared):
        # A driver takes some of the robot's parameters; the others are those of other nodes.
        return owner != "robot" or rest not in {each.name for each in fields(Robot)}
    return owner not in _names()


@cache
def _executables() -> tuple[str, ...]:
    return tuple(path.stem for path in Path(__file__).parent.glob("*_node.py"))


@cache
def _names() -> frozenset[str]:
    """Return the names of the parameters that nodes of the package have, each up to its first dot.

    Read from the source: importing every other node to ask it would make each start slower.
    """
    package = Path(__file__).parent.parent
    names: set[str] = set()
    for path in package.rglob("*.py"):
        for found in _NAMES.findall(path.read_text(encoding="utf-8")):
            names.update(found)
    return frozenset(names)
