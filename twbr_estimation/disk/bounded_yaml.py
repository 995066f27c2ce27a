"""YAML from files of any origin: safe, within limits of size, depth and number of values.

A first pass over the events, which needs no recursion, counts what the text holds, aliases
with all that they repeat. Only then is anything built.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, cast

import yaml

from ..errors import TwbrError
from .reading import read_text

SIZE_LIMIT = 1 << 20
"""Largest file [bytes]."""
VALUE_LIMIT = 100_000
"""Most values in a file, repeated ones counted each time."""
DEPTH_LIMIT = 32
"""Deepest nesting."""
_INTEGER_LIMIT = 2**63
_UNFIT = (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError)
"""What PyYAML raises for a value that does not fit its kind."""
_LOADER: type[Any] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_EXPONENT = re.compile(r"^[-+]?(?:\d+\.?\d*|\.\d+)[eE][-+]?\d+$")


class _Loader(_LOADER):  # type: ignore[misc]
    """Safe YAML, with 1e-5 a number as it is for ROS, and no key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Refuse a repeated key, whose first value would be lost."""
        seen = set()
        for key, _ in node.value:
            name = self.construct_object(key, deep=True)
            if not isinstance(name, (str, int, float, bool, type(None))):
                raise yaml.MarkedYAMLError(problem="a key is no name", problem_mark=key.start_mark)
            if name in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"key {_short(name)} twice", problem_mark=key.start_mark
                )
            seen.add(name)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep=deep)
        return mapping

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Turn what a conversion raises into an error with its place in the file."""
        try:
            value = super().construct_object(node, deep=deep)
        except _UNFIT as error:
            if isinstance(error, yaml.YAMLError):
                raise
            kind = str(node.tag).rpartition(":")[2]
            raise yaml.MarkedYAMLError(
                problem=f"{_short(node.value)} is no {kind}", problem_mark=node.start_mark
            ) from None
        if isinstance(value, int) and abs(value) > _INTEGER_LIMIT:
            raise yaml.MarkedYAMLError(
                problem=f"{_short(node.value)} is beyond 64 bits", problem_mark=node.start_mark
            )
        return value


_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _EXPONENT, list("-+.0123456789"))


def load_yaml(
    path: Path,
    error: type[TwbrError],
    size_limit: int = SIZE_LIMIT,
    value_limit: int = VALUE_LIMIT,
) -> Any:
    """Return the content of a YAML file.

    Args:
        path: file to read.
        error: what is raised where it cannot be used.
        size_limit: largest file [bytes].
        value_limit: most values in it.

    Raises:
        TwbrError: as `error` says; the message names file, place and limit.
    """
    text = read_text(path, size_limit, error)
    try:
        _require_bounded(text, value_limit)
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as problem:
        raise error(f"{path}: not valid YAML: {_described(problem)}") from None
    except _UNFIT as problem:
        raise error(f"{path}: not valid YAML: a value of the wrong kind: {problem}") from None


def _require_bounded(text: str, value_limit: int) -> None:
    """Raise YAMLError where the text nests too deeply or holds too many values."""
    sizes: dict[str | None, int] = {}
    open_nodes: list[tuple[str | None, int]] = []
    total = 0
    loader = _Loader(text)
    try:
        while loader.check_event():
            event = loader.get_event()
            if isinstance(event, yaml.CollectionEndEvent):
                anchor, before = open_nodes.pop()
                if anchor is not None:
                    sizes[anchor] = total - before
                continue
            if not isinstance(event, yaml.NodeEvent):
                continue
            total += _repeated(event, sizes, open_nodes)
            if isinstance(event, yaml.CollectionStartEvent):
                open_nodes.append((event.anchor, total - 1))
            elif not isinstance(event, yaml.AliasEvent) and event.anchor is not None:
                sizes[event.anchor] = 1
            if len(open_nodes) > DEPTH_LIMIT:
                raise _beyond(event, f"nested deeper than {DEPTH_LIMIT} levels")
            if total > value_limit:
                raise _beyond(event, f"more than {value_limit} values")
    finally:
        loader.dispose()


def _repeated(
    event: yaml.NodeEvent, sizes: dict[str | None, int], open_nodes: list[tuple[str | None, int]]
) -> int:
    """Return how many values an event represents: an alias counts all that it repeats."""
    if not isinstance(event, yaml.AliasEvent):
        return 1
    if any(event.anchor == anchor for anchor, _ in open_nodes):
        raise _beyond(event, f"{_short(event.anchor)} repeats itself")
    return sizes.get(event.anchor, 1)


def _beyond(event: yaml.Event, what: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=what, problem_mark=cast(Any, event.start_mark))


def _short(value: Any) -> str:
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _described(problem: yaml.YAMLError) -> str:
    """Return one line without the parser's own name for the text."""
    text = " ".join(str(problem).split())
    return re.sub(r'in "<(unicode|byte) string>", ', "at ", text)
