"""The loops over columns, made of the step functions of the live path."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ..filters.base import Filter
from ..live_code.layout import Layout
from ..pipeline import correction
from ..samples import RESTART_GAP, CorrectedSample, Sample, TiltEstimate, nearest, published

SOURCES = (
    "samples.py",
    "compilation.py",
    "pipeline/*.py",
    "plants/*.py",
    "filters/**/*.py",
    "batch/kernels.py",
    "batch/loops.py",
    "live_code/layout.py",
)
"""What the compiled loops are made of."""
Run = Callable[[Any, Any, Any, Any, Any, Any], None]
"""A loop: takes how many samples there are, the first of them, their columns, rows of coefficients
and state, and the columns of results; fills the results from the first on, and changes the state.
"""


class LoopLayouts(NamedTuple):
    """How coefficients and state of a loop lie in their rows."""

    coefficients: Layout
    state: Layout

    @property
    def key(self) -> str:
        """What the compiled loop depends on beside its sources."""
        return f"{self.coefficients.reading} {self.state.reading}"


def _reader(record: type[Any], name: str) -> Callable[[Any, int, float], Any]:
    """Return the function (columns, i, tilt) that makes a record of column `i`, compiled or not.

    An `angle` is taken as a filter of that tilt does. Compiled code needs a call with one argument
    a field, so it is written from the fields.
    """
    values = {field: f"columns[{row}, i]" for row, field in enumerate(record._fields)}
    if "angle" in values:
        values["angle"] = f"nearest({values['angle']}, tilt)"
    fields = ", ".join(f"{field}={value}" for field, value in values.items())
    space: dict[str, Any] = {"__name__": __name__, "record": record, "nearest": nearest}
    exec(f"def {name}(columns, i, tilt):\n    return record({fields})", space)
    reader: Callable[[Any, int, float], Any] = space[name]
    return reader


raw_sample_at = _reader(Sample, "raw_sample_at")
sample_at = _reader(CorrectedSample, "sample_at")


def correction_loop(layouts: LoopLayouts) -> Run:
    """Return the loop of the correction over the columns of a `SampleTrack`."""
    start, step = correction.start, correction.step
    coefficients_of, state_of = layouts.coefficients.reader(), layouts.state.reader()
    keep = layouts.state.writer()

    def run(
        count: Any, first: Any, columns: Any, coefficients: Any, kept: Any, corrected: Any
    ) -> None:
        chosen, state = coefficients_of(coefficients), state_of(kept)
        for i in range(first, count):
            sample = raw_sample_at(columns, i, 0.0)
            if sample.dt > RESTART_GAP:
                state, result = start(sample, chosen)
            else:
                state, result = step(state, sample, chosen)
            for field in range(len(result)):
                corrected[field, i] = result[field]
        keep(state, kept)

    return run


def filter_loop(entry: Filter, layouts: LoopLayouts) -> Run:
    """Return the loop of a filter over corrected columns."""
    step, reset = entry.step, entry.reset
    with_bias, with_variance = entry.estimates_gyro_bias, entry.estimates_variance
    coefficients_of, state_of = layouts.coefficients.reader(), layouts.state.reader()
    keep = layouts.state.writer()

    def run(
        count: Any, first: Any, columns: Any, coefficients: Any, kept: Any, estimates: Any
    ) -> None:
        chosen, state = coefficients_of(coefficients), state_of(kept)
        for i in range(first, count):
            sample = sample_at(columns, i, state.tilt)
            if sample.dt > RESTART_GAP:
                bias = state.gyro_bias if with_bias else 0.0
                fresh = TiltEstimate(sample.angle, sample.gyro_y - bias, bias, 0.0)
                state = reset(fresh, sample, chosen)
            else:
                state = step(state, sample, chosen)
            estimates[0, i] = published(state.tilt)
            estimates[1, i] = state.rate
            if with_bias:
                estimates[2, i] = state.gyro_bias
            if with_variance:
                estimates[3, i] = state.tilt_variance
        keep(state, kept)

    return run


def is_ours(entry: Filter) -> bool:
    """Return whether every function of a filter's loop belongs to this package."""
    package = __name__.partition(".")[0]
    parts = (entry.step, entry.reset, entry.state, entry.parameters)
    return all(part.__module__.partition(".")[0] == package for part in parts)
