"""Records as rows of doubles, which is what interpreted and compiled code exchange."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..errors import TwbrError

Form = object
"""Types in a record, and the shapes of its arrays; it can be hashed."""


class LayoutError(TwbrError):
    """A record holds something else than numbers, tuples and arrays of doubles."""


class Layout:
    """Where the numbers of a record lie, learnt from one instance.

    A record is a float, an int, a bool, an array of doubles of fixed shape, or a tuple of such,
    named or not, to any depth.
    """

    def __init__(self, example: Any) -> None:
        """Learn from an instance.

        Raises:
            LayoutError: it holds something else.
        """
        self._kinds: dict[str, type[Any]] = {}
        self._numbers = 0
        """How many doubles hold all numbers outside of the arrays; large arrays come last."""
        self.reading, self.size = self._read(example, 0)
        """The expression that makes the record, and how many doubles it takes. It takes numbers
        from `row` and arrays from `array`, which hold the same doubles."""
        self._writing = [
            f"row[{place}] = {value}" for place, value in self._written(example, "record", 0)
        ]
        self._pack = struct.Struct(f"{self.size}d").pack_into

    def _read(self, example: Any, place: int) -> tuple[str, int]:
        """Return the expression that makes the record, and how many doubles it takes."""
        if isinstance(example, (bool, int, float)):
            self._numbers = max(self._numbers, place + 1)
        if isinstance(example, bool):
            return f"row[{place}] != 0.0", 1
        if isinstance(example, int):
            return f"int(row[{place}])", 1
        if isinstance(example, float):
            return f"row[{place}]", 1
        if isinstance(example, np.ndarray) and example.dtype == np.float64:
            end = place + example.size
            return f"array[{place}:{end}].reshape({example.shape}).copy()", example.size
        if not isinstance(example, tuple):
            raise LayoutError(f"{type(example).__name__} {example!r} is no number of a record")
        parts, size = [], 0
        for part in example:
            text, used = self._read(part, place + size)
            parts.append(text)
            size += used
        inside = ", ".join(parts)
        if type(example) is tuple:
            return f"({inside},)" if parts else "()", size
        name = self._name_of(type(example))
        return f"{name}({inside})", size

    def _name_of(self, kind: type[Any]) -> str:
        """Return a name for a kind of record; two kinds may have the same of their own."""
        for name, known in self._kinds.items():
            if known is kind:
                return name
        name = f"{kind.__name__}_{len(self._kinds)}"
        self._kinds[name] = kind
        return name

    def _written(self, example: Any, value: str, place: int) -> Iterator[tuple[str, str]]:
        """Yield places and the expressions of what is written there."""
        if isinstance(example, np.ndarray):
            yield f"{place}:{place + example.size}", f"{value}.reshape({example.size})"
        elif not isinstance(example, tuple):
            yield f"{place}", value
        else:
            names = getattr(example, "_fields", None)
            for index, part in enumerate(example):
                inner = f"{value}[{index}]" if names is None else f"{value}.{names[index]}"
                yield from self._written(part, inner, place)
                place += self._read(part, 0)[1]

    def reader(self) -> Callable[[Any], Any]:
        """Return the function that makes the record from an array, compiled or not."""
        return self._reader("array")

    def plain_reader(self) -> Callable[[Any], Any]:
        """Return the same function for the interpreter: its numbers are plain, and it is faster."""
        return self._reader(f"array[:{self._numbers}].tolist()")

    def _reader(self, row: str) -> Callable[[Any], Any]:
        source = f"def read(array):\n    row = {row}\n    return {self.reading}\n"
        read: Callable[[Any], Any] = self._function(source, "read")
        return read

    def writer(self) -> Callable[[Any, Any], None]:
        """Return the function (record, row) that writes the record into an array."""
        body = "\n    ".join(self._writing) or "pass"
        write: Callable[[Any, Any], None] = self._function(
            f"def write(record, row):\n    {body}\n", "write"
        )
        return write

    def _function(self, source: str, name: str) -> Any:
        space: dict[str, Any] = {"__name__": __name__, **self._kinds}
        exec(source, space)
        return space[name]

    def pack(self, record: Any, memory: Any) -> None:
        """Write a record into memory, as `writer` does into an array."""
        self._pack(memory, 0, *numbers_of(record))


def form_of(record: Any) -> Form:
    """Return what the layout of a record depends on: equal for records of one layout."""
    if isinstance(record, tuple):
        # Most parts are floats: a call for each would take as long as a hundred samples do.
        parts = [float if type(part) is float else form_of(part) for part in record]
        return type(record), tuple(parts)
    if isinstance(record, np.ndarray):
        return record.dtype, record.shape
    return type(record)


def numbers_of(record: Any) -> Sequence[float]:
    """Return all numbers of a record in the order of their places."""
    if isinstance(record, np.ndarray):
        numbers: list[float] = record.ravel().tolist()
        return numbers
    if isinstance(record, tuple):
        return [number for part in record for number in numbers_of(part)]
    return (record,)
