"""Loops as machine code: loaded where a file has them, else compiled and kept in one.

Loading takes no numba, whose import alone takes longer than all else of a short command.
"""

from __future__ import annotations

import ctypes
import hashlib
import threading
from contextlib import suppress
from functools import lru_cache
from typing import Any, cast

import numpy as np

from ..filters.base import Filter
from ..live_code import files
from ..live_code.layout import Form, Layout, form_of
from ..live_code.loading import Function, function_of, processor
from ..pipeline import correction
from ..recording import FloatArray
from ..samples import CorrectedSample, Sample, TiltEstimate
from .kernels import SOURCES, LoopLayouts, Run, correction_loop, filter_loop, is_ours

CORRECTION = "correction"
"""Name of the correction's loop among those of the filters."""
ENDING = "loop"
"""Of the files of loops."""
_ONE_AT_A_TIME = threading.RLock()
"""Held while code is compiled or loaded; compiled loops run side by side."""
_KIND = ctypes.CFUNCTYPE(None, *(ctypes.c_int64,) * 2, *(ctypes.c_void_p,) * 4)  # frees the GIL


class CompiledLoop:
    """The loop of one filter, or of the correction, for records of one layout."""

    def __init__(self, entry: Filter | None, layouts: LoopLayouts) -> None:
        """Begin without any machine code.

        Args:
            entry: the filter; None for the correction.
            layouts: of its coefficients and state.
        """
        self._entry, self._layouts = entry, layouts
        self._write_coefficients = layouts.coefficients.writer()
        self._write_state = layouts.state.writer()
        self._state_of = layouts.state.plain_reader()
        self._name = CORRECTION if entry is None else entry.name
        self._made = _made_for(layouts) if entry is None or is_ours(entry) else ""
        self._function: Function | None = None

    @property
    def is_ready(self) -> bool:
        """Whether it is compiled; where a file has it, it is loaded."""
        with _ONE_AT_A_TIME:
            if self._function is None and self._made:
                kept = files.kept(self._name, self._made, ENDING)
                with suppress(ImportError, OSError, RuntimeError, AttributeError):
                    self._function = function_of(kept, _KIND) if kept else None
            return self._function is not None

    @property
    def can_be_kept(self) -> bool:
        """Whether a file may hold it: that of a user's filter would not notice a change of it."""
        return bool(self._made)

    def __call__(
        self, columns: FloatArray, first: int, coefficients: Any, state: Any, results: FloatArray
    ) -> Any:
        """Run from sample `first` on, compiled if it is not yet, and return the last state.

        Args:
            columns: fields of the samples as rows, (f, n).
            first: index of the first sample.
            coefficients: of the filter or the correction.
            state: before that sample.
            results: fields of the results as rows, (r, n); filled from `first` on.
        """
        self.compile()
        function = cast("Function", self._function)
        columns = np.ascontiguousarray(columns)
        chosen, kept = (np.empty(each.size) for each in self._layouts)
        self._write_coefficients(coefficients, chosen)
        self._write_state(state, kept)
        arrays = (each.ctypes.data for each in (columns, chosen, kept, results))
        function(columns.shape[1], first, *arrays)
        return self._state_of(kept)

    def compile(self) -> None:
        """Compile it where it is not, and keep it if it may be."""
        with _ONE_AT_A_TIME:
            if self.is_ready:
                return
            from ..compilation import object_code

            code, name = object_code(self._run(), self._shapes(), ("count", "first"))
            found = files.ObjectCode(name, code)
            if self._made:
                files.saved(self._name, self._made, found, ENDING)
            self._function = function_of(found, _KIND)

    def _run(self) -> Run:
        if self._entry is None:
            return correction_loop(self._layouts)
        return filter_loop(self._entry, self._layouts)

    def _shapes(self) -> dict[str, str]:
        samples, results = (
            (Sample, CorrectedSample) if self._entry is None else (CorrectedSample, TiltEstimate)
        )
        return {
            "columns": f"{len(samples._fields)}, count",
            "coefficients": str(self._layouts.coefficients.size),
            "kept": str(self._layouts.state.size),
            "results": f"{len(results._fields)}, count",
        }


def loop_of_correction(first: Sample, coefficients: Any) -> CompiledLoop:
    """Return the loop of the correction for such samples and coefficients."""
    return _loop(None, coefficients, correction.start(first, coefficients)[0])


def loop_of_filter(
    entry: Filter, first: CorrectedSample, coefficients: Any, state: Any
) -> CompiledLoop:
    """Return the loop of a filter.

    Args:
        entry: the filter.
        first: a sample.
        coefficients: derived from its parameters.
        state: before that sample.

    Raises:
        LayoutError: coefficients or state hold something else than numbers.
    """
    start = entry, form_of(coefficients), form_of(state)
    if start not in _by_start:
        with suppress(ArithmeticError, ValueError), np.errstate(all="ignore"):
            state = entry.step(state, first, coefficients)  # numbers may be whole only at the start
        found = _loop(entry, coefficients, state)
        if not is_ours(entry):  # whose numbers may be whole by chance
            return found
        _by_start[start] = found
    return _by_start[start]


def _loop(entry: Filter | None, coefficients: Any, state: Any) -> CompiledLoop:
    form = entry, form_of(coefficients), form_of(state)
    if form not in _by_form:  # layouts take longer to make than simple filters to run
        layouts = LoopLayouts(Layout(coefficients), Layout(state))
        key = entry, layouts.key
        if key not in _loops:
            _loops[key] = CompiledLoop(entry, layouts)
        _by_form[form] = _loops[key]
    return _by_form[form]


_loops: dict[tuple[Filter | None, str], CompiledLoop] = {}
_by_form: dict[tuple[Filter | None, Form, Form], CompiledLoop] = {}
_by_start: dict[tuple[Filter, Form, Form], CompiledLoop] = {}


@lru_cache
def _processor() -> str:
    try:
        return processor()
    except ImportError:
        return ""


def _made_for(layouts: LoopLayouts) -> str:
    """Return a digest of all that the machine code depends on; empty where it is not known."""
    here = _processor()
    made = files.made_for(here, SOURCES) if here else ""
    return f"{made}-{hashlib.sha256(layouts.key.encode()).hexdigest()[:8]}" if made else ""
