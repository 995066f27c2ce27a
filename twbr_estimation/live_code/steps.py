"""The steps that are compiled for the live path: what goes in, what comes out.

A step is a function (sample, coefficients, state, results) of rows of doubles: it changes the row
of its state and fills that of its results. It is derived from the functions of the live path.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ..filters.base import Filter
from ..pipeline import correction, validity
from ..pipeline.coefficients import derive
from ..robot import Robot, Setup
from ..samples import STANDARD_GRAVITY, CorrectedSample, Sample, TiltEstimate
from .layout import Layout


class Judged(NamedTuple):
    """What a filter's step gives: its estimate, and the monitor's judgement."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    trusted: float
    astray: float
    doubt: float
    missed: float
    certain_for: float


class StepLayouts(NamedTuple):
    """How the records of a step lie in memory."""

    sample: Layout
    coefficients: Layout
    state: Layout
    results: Layout


def first_sample() -> CorrectedSample:
    """Return a sample at rest."""
    return correction.start(_raw_sample(), derive(Setup()))[1]


def _raw_sample() -> Sample:
    return Sample(0.005, 0.0, 0.0, 0.0, 0.0, 0.0, STANDARD_GRAVITY)


def correction_layouts() -> StepLayouts:
    """Return those of the correction, for polynomials of the usual length."""
    coefficients = derive(Setup())
    state, corrected = correction.start(_raw_sample(), coefficients)
    records = (_raw_sample(), coefficients, state, corrected)
    return StepLayouts(*(Layout(record) for record in records))


def filter_layouts(entry: Filter) -> StepLayouts:
    """Return those of a filter with the monitor beside it.

    Raises:
        LayoutError: its state or coefficients are no numbers.
    """
    sample, estimate = first_sample(), TiltEstimate(0.0, 0.0)
    coefficients = entry.derive(entry.configure(None), Robot())
    state = entry.reset(estimate, sample, coefficients)
    watch = validity.begin(sample, estimate, False)
    judged = Judged(*(0.0 for _ in Judged._fields))
    records = (sample, (coefficients, validity.VALID_STDDEV), (state, watch), judged)
    return StepLayouts(*(Layout(record) for record in records))


def correction_step() -> Callable[..., None]:
    """Return the step of the correction on rows."""
    layouts, step = correction_layouts(), correction.step
    sample_of, coefficients_of = layouts.sample.reader(), layouts.coefficients.reader()
    state_of, keep, give = layouts.state.reader(), layouts.state.writer(), layouts.results.writer()

    def run(sample: Any, coefficients: Any, state: Any, results: Any) -> None:
        following, corrected = step(
            state_of(state), sample_of(sample), coefficients_of(coefficients)
        )
        keep(following, state)
        give(corrected, results)

    return run


def filter_step(entry: Filter, self_judged: bool) -> Callable[..., None]:
    """Return the step of a filter and its monitor on rows."""
    layouts, step, watch = filter_layouts(entry), entry.step, validity.watch
    sample_of, coefficients_of = layouts.sample.reader(), layouts.coefficients.reader()
    state_of, keep, give = layouts.state.reader(), layouts.state.writer(), layouts.results.writer()
    with_bias, with_variance = entry.estimates_gyro_bias, entry.estimates_variance

    def run(sample: Any, coefficients: Any, state: Any, results: Any) -> None:
        before, seen = state_of(state)
        reading = sample_of(sample)
        chosen, valid_stddev = coefficients_of(coefficients)
        after = step(before, reading, chosen)
        bias, variance = 0.0, 0.0
        if with_bias:
            bias = after.gyro_bias
        if with_variance:
            variance = after.tilt_variance
        estimate = TiltEstimate(after.tilt, after.rate, bias, variance)
        now = watch(seen, reading, estimate, valid_stddev, self_judged)
        keep((after, now), state)
        give(
            Judged(
                after.tilt,
                after.rate,
                bias,
                variance,
                now.judgement.trusted,
                now.judgement.astray,
                now.judgement.doubt,
                now.missed,
                now.certainty.time,
            ),
            results,
        )

    return run
