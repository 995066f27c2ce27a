"""Run the correction and filters over tracks: interpreted while that is quicker, else compiled.

Both ways give the same numbers, bit by bit. Compiling a loop takes seconds, which is worthwhile
for long recordings and many runs only; a loop that is already in the cache on disk is always used.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..filters.base import Filter
from ..live_code.layout import LayoutError
from ..pipeline import correction
from ..pipeline.coefficients import derive
from ..pipeline.correction import Corrector
from ..pipeline.oversampling import Oversampler
from ..pipeline.pairing import SampleTrack
from ..pipeline.tilt_filter import TiltFilter
from ..robot import Robot, Setup
from ..samples import CorrectedSample, Sample, TiltEstimate, nearest, published
from .kernels import is_ours
from .loops import CompiledLoop, loop_of_correction, loop_of_filter
from .tracks import CorrectedTrack, EstimateTrack

COMPILE_AFTER = 60_000
"""Samples from which on compiling a loop takes less time than interpreting it."""
_interpreted: Counter[CompiledLoop] = Counter()  # samples, in this process


def correct(samples: SampleTrack, setup: Setup) -> CorrectedTrack:
    """Correct a whole track, as `correction.Corrector` would sample by sample.

    Args:
        samples: n paired samples.
        setup: robot, calibration and settings.

    Returns:
        n corrected samples.
    """
    if samples.stamps.size == 0:
        return correct_compiled(samples, setup)
    loop = loop_of_correction(_first(samples), derive(setup))
    if _stays_interpreted(loop, samples.stamps.size):
        corrector = Corrector(setup)
        found = [corrector.step(Sample(*column)) for column in samples.columns.T.tolist()]
        return CorrectedTrack(samples.stamps, np.array(found).T.copy())
    return correct_compiled(samples, setup)


def correct_compiled(samples: SampleTrack, setup: Setup) -> CorrectedTrack:
    """Correct as `correct` does, always by the compiled loop."""
    corrected = np.empty((len(CorrectedSample._fields), samples.stamps.size))
    if samples.stamps.size == 0:
        return CorrectedTrack(samples.stamps, corrected)
    coefficients, first = derive(setup), _first(samples)
    state, corrected[:, 0] = correction.start(first, coefficients)
    loop = loop_of_correction(first, coefficients)
    loop(samples.columns, 1, coefficients, state, corrected)
    return CorrectedTrack(samples.stamps, corrected)


def _first(samples: SampleTrack) -> Sample:
    return Sample(*samples.columns[:, 0].tolist())


def run_filter(
    entry: Filter,
    parameters: Any,
    corrected: CorrectedTrack,
    robot: Robot,
    state: Any | None = None,
) -> EstimateTrack:
    """Run one filter over a whole track.

    Args:
        entry: the filter.
        parameters: its validated parameters, from `entry.configure`.
        corrected: n corrected samples.
        robot: geometry, for filters that need it.
        state: where an earlier run ended; None starts from the first sample's angle.

    Returns:
        n estimates and the state to go on from.
    """
    size = corrected.stamps.size
    if size == 0:
        return run_compiled(entry, parameters, corrected, robot, state)
    try:
        begun = _begun(entry, parameters, corrected, robot, state)
    except LayoutError:
        return _interpret(entry, parameters, corrected, robot, state)
    if _stays_interpreted(begun.loop, size):
        try:
            return _interpret(entry, parameters, corrected, robot, state)
        except (ArithmeticError, ValueError):
            pass  # where a filter diverges, Python raises what compiled code turns into inf or nan
    if not is_ours(entry) and not _can_be_compiled(begun.loop):
        return _interpret(entry, parameters, corrected, robot, state)
    return _run(begun, corrected)


def _can_be_compiled(loop: CompiledLoop) -> bool:
    """Compile the loop of a user's own filter, where numba can."""
    from ..compilation import NOT_COMPILABLE

    try:
        loop.compile()
    except NOT_COMPILABLE:
        return False
    return True


def _interpret(
    entry: Filter, parameters: Any, corrected: CorrectedTrack, robot: Robot, state: Any | None
) -> EstimateTrack:
    running = TiltFilter(entry, parameters._asdict(), robot, state)
    found = []
    with np.errstate(all="ignore"):
        for column in corrected.columns.T.tolist():
            sample = CorrectedSample(*column)
            if running.state is not None:
                sample = sample._replace(angle=nearest(sample.angle, running.state.tilt))
            estimate = running.step(sample)
            found.append((published(estimate.tilt), *estimate[1:]))
    return EstimateTrack(corrected.stamps, np.array(found).T.copy(), running.state)


def run_compiled(
    entry: Filter, parameters: Any, corrected: CorrectedTrack, robot: Robot, state: Any | None
) -> EstimateTrack:
    """Run a filter as `run_filter` does, always by the compiled loop."""
    if corrected.stamps.size == 0:
        return EstimateTrack(corrected.stamps, np.zeros((len(TiltEstimate._fields), 0)), state)
    return _run(_begun(entry, parameters, corrected, robot, state), corrected)


class _Begun(NamedTuple):
    """A filter before its first step."""

    loop: CompiledLoop
    coefficients: Any
    state: Any
    first: int
    """Index of the sample that the first step takes."""


def _begun(
    entry: Filter, parameters: Any, corrected: CorrectedTrack, robot: Robot, state: Any | None
) -> _Begun:
    """Return the filter with the state to go on from, or that of the first sample's angle.

    Raises:
        LayoutError: its records hold something else than numbers.
    """
    coefficients, sample = entry.derive(parameters, robot), corrected.first
    first = 0
    if state is None:
        state = entry.reset(TiltEstimate(sample.angle, sample.gyro_y), sample, coefficients)
        first = 1
    return _Begun(loop_of_filter(entry, sample, coefficients, state), coefficients, state, first)


def _run(begun: _Begun, corrected: CorrectedTrack) -> EstimateTrack:
    estimates = np.zeros((len(TiltEstimate._fields), corrected.stamps.size))
    if begun.first:
        for row, name in enumerate(TiltEstimate._fields):
            estimates[row, 0] = getattr(begun.state, name, 0.0)
    state = begun.loop(corrected.columns, begun.first, begun.coefficients, begun.state, estimates)
    return EstimateTrack(corrected.stamps, estimates, state)


def _stays_interpreted(loop: CompiledLoop, samples: int) -> bool:
    """Return whether a loop over so many samples more is quicker done without compiling it."""
    if loop.is_ready:
        return False
    _interpreted[loop] += samples
    return _interpreted[loop] <= COMPILE_AFTER


def run_filters(
    chosen: Sequence[tuple[Filter, Any]], corrected: CorrectedTrack, robot: Robot
) -> list[EstimateTrack]:
    """Run several filters over a track, compiled ones side by side.

    Args:
        chosen: filters with their validated parameters.
        corrected: n corrected samples.
        robot: geometry, for filters that need it.
    """

    def run(each: tuple[Filter, Any]) -> EstimateTrack:
        return run_filter(*each, corrected, robot)

    if len(chosen) < 2:
        return [run(each) for each in chosen]
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(run, chosen))


def oversampled(corrected: CorrectedTrack, period: float) -> CorrectedTrack:
    """Combine corrected samples into a loop of `period` [s], as an `Oversampler` would.

    The samples of a last interval that does not end are left out.
    """
    if corrected.stamps.size == 0:
        return corrected
    oversampler, kept, columns = Oversampler(period), [], []
    for index, column in enumerate(corrected.columns.T.tolist()):
        sample = oversampler.add(CorrectedSample(*column))
        if sample is not None:
            kept.append(index)
            columns.append(sample)
    return CorrectedTrack(corrected.stamps[kept], np.array(columns).T.copy())
