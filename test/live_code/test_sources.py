"""The digest of a compiled step covers every module that the step is made of."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FunctionType
from typing import Any

from twbr_estimation.filters.base import filters
from twbr_estimation.live_code import files
from twbr_estimation.live_code.steps import correction_step, filter_step

PACKAGE = Path(files.__file__).parent.parent


def called_by(function: Any, seen: set[Any]) -> None:
    """Collect the plain functions that a function calls, as the compiler finds them."""
    if not isinstance(function, FunctionType) or function in seen:
        return
    seen.add(function)
    spelled = getattr(function, "compiled_as", function)
    for name in spelled.__code__.co_names:
        called_by(spelled.__globals__.get(name), seen)
    for cell in spelled.__closure__ or ():
        called_by(cell.cell_contents, seen)


def test_what_a_step_calls_is_among_the_sources() -> None:
    seen: set[Any] = set()
    called_by(correction_step(), seen)
    for name, entry in filters().items():
        called_by(filter_step(entry, name == "ins_odometer"), seen)
    made_of = {Path(str(sys.modules[each.__module__].__file__)) for each in seen}
    covered = {path for pattern in files.SOURCES for path in PACKAGE.glob(pattern)}
    ours = {path for path in made_of if path.is_relative_to(PACKAGE)}
    assert len(ours) > 10
    assert ours <= covered
