"""The loops over columns, compiled from the step functions of the live path."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from ..filters.base import Filter
from ..pipeline import correction
from ..samples import RESTART_GAP, CorrectedSample, Sample, TiltEstimate

SOURCES = ("samples.py", "pipeline/*.py", "plants/*.py", "filters/**/*.py", "batch/*.py")
"""What the compiled loops are made of."""


def _reader(record: type[Any], name: str) -> Callable[[Any, int], Any]:
    """Return the function (columns, i) that makes a record of column `i`, compiled or not.

    Compiled code needs a call with one argument a field, so it is written from the fields.
    """
    fields = ", ".join(f"{field}=columns[{row}, i]" for row, field in enumerate(record._fields))
    space: dict[str, Any] = {"__name__": __name__, "record": record}
    exec(f"def {name}(columns, i):\n    return record({fields})", space)
    reader: Callable[[Any, int], Any] = space[name]
    return reader


raw_sample_at = _reader(Sample, "raw_sample_at")
sample_at = _reader(CorrectedSample, "sample_at")


@cache
def correction_kernel() -> Any:
    """Return the compiled loop of the correction over the columns of a `SampleTrack`.

    It takes (columns, coefficients, state, corrected) and fills `corrected` from index 1 on.
    """
    from ..compilation import compiled, source_version

    start, step = correction.start, correction.step

    def run(columns: Any, coefficients: Any, state: Any, corrected: Any) -> None:
        for i in range(1, columns.shape[1]):
            sample = raw_sample_at(columns, i)
            if sample.dt > RESTART_GAP:
                state, result = start(sample, coefficients)
            else:
                state, result = step(state, sample, coefficients)
            for field in range(len(result)):
                corrected[field, i] = result[field]

    return compiled(run, source_version(SOURCES), raw_sample_at, start, step, name="correction")


@cache
def filter_kernel(entry: Filter) -> Any:
    """Return the compiled loop of a filter over corrected columns.

    It takes (columns, first, coefficients, state, estimates), fills `estimates` from index
    `first` on and returns the last state. A user's own filter is compiled again in each process,
    as the cache on disk would not notice a change of it.
    """
    from ..compilation import compiled, source_version

    step, reset = entry.step, entry.reset
    with_bias, with_variance = entry.estimates_gyro_bias, entry.estimates_variance

    def run(columns: Any, first: int, coefficients: Any, state: Any, estimates: Any) -> Any:
        for i in range(first, columns.shape[1]):
            sample = sample_at(columns, i)
            if sample.dt > RESTART_GAP:
                bias = state.gyro_bias if with_bias else 0.0
                fresh = TiltEstimate(sample.angle, sample.gyro_y - bias, bias, 0.0)
                state = reset(fresh, sample, coefficients)
            else:
                state = step(state, sample, coefficients)
            estimates[0, i] = state.tilt
            estimates[1, i] = state.rate
            if with_bias:
                estimates[2, i] = state.gyro_bias
            if with_variance:
                estimates[3, i] = state.tilt_variance
        return state

    version = source_version(SOURCES) if is_ours(entry) else None
    return compiled(run, version, sample_at, step, reset, name=entry.name)


def is_ours(entry: Filter) -> bool:
    """Return whether every function of a filter's loop belongs to this package."""
    package = __name__.partition(".")[0]
    parts = (entry.step, entry.reset, entry.state, entry.parameters)
    return all(part.__module__.partition(".")[0] == package for part in parts)
