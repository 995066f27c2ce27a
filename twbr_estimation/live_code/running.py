"""A compiled step with the memory it works on."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from .layout import numbers_of
from .loading import Function
from .steps import StepLayouts


class CompiledStep:
    """One compiled step: its state lies in memory of its own until it is asked for."""

    def __init__(self, function: Function, layouts: StepLayouts) -> None:
        """Provide memory for it.

        Args:
            function: The machine code.
            layouts: How its records lie in memory.
        """
        self._function, self._layouts = function, layouts
        self._rows = [np.zeros(each.size) for each in layouts]
        self._memory = [row.data.cast("B") for row in self._rows]
        self._addresses = tuple(row.ctypes.data for row in self._rows)
        self._state_of = layouts.state.plain_reader()
        self._pack = struct.Struct(f"{layouts.sample.size}d").pack_into
        self._results = struct.Struct(f"{layouts.results.size}d").unpack_from

    def begin(self, coefficients: Any, state: Any) -> bool:
        """Go on from a state, with these coefficients; False where they do not fit the code."""
        return self.change(coefficients) and self._write(2, state)

    def change(self, coefficients: Any) -> bool:
        """Go on with other coefficients; False, and nothing changed, where they do not fit."""
        return self._write(1, coefficients)

    def _write(self, place: int, record: Any) -> bool:
        numbers = numbers_of(record)
        if len(numbers) != self._layouts[place].size:
            return False
        self._rows[place][:] = numbers
        return True

    def step(self, sample: tuple[float, ...]) -> tuple[float, ...]:
        """Take a sample; return the results."""
        self._pack(self._memory[0], 0, *sample)
        self._function(*self._addresses)
        results: tuple[float, ...] = self._results(self._memory[3])
        return results

    def state(self) -> Any:
        """Return the state as it is now."""
        return self._state_of(self._rows[2])
