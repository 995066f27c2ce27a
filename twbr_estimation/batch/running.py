"""Run the correction and filters over tracks: interpreted while that is quicker, else compiled.

Both ways give the same numbers, bit by bit. Compiling a loop takes seconds, which is worthwhile
for long recordings and many runs only; a loop that is already in the cache on disk is always used.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ..filters.base import Filter
from ..pipeline import correction
from ..pipeline.coefficients import derive
from ..pipeline.correction import Corrector
from ..pipeline.oversampling import Oversampler
from ..pipeline.pairing import SampleTrack
from ..pipeline.tilt_filter import TiltFilter
from ..recording import FloatArray
from ..robot import Robot, Setup
from ..samples import CorrectedSample, Sample, TiltEstimate
from .kernels import correction_kernel, filter_kernel, is_ours
from .tracks import CorrectedTrack, EstimateTrack

COMPILE_AFTER = 60_000
"""Samples from which on compiling a loop takes less time than interpreting it."""
_interpreted: Counter[Any] = Counter()  # samples by loop, in this process


def correct(samples: SampleTrack, setup: Setup) -> CorrectedTrack:
    """Correct a whole track, as `correction.Corrector` would sample by sample.

    Args:
        samples: n paired samples.
        setup: robot, calibration and settings.

    Returns:
        n corrected samples.
    """
    if samples.stamps.size > 0 and _stays_interpreted(
        correct, correction_kernel, samples.stamps.size
    ):
        corrector = Corrector(setup)
        found = [corrector.step(Sample(*column)) for column in samples.columns.T.tolist()]
        return CorrectedTrack(samples.stamps, np.array(found).T.copy())
    return correct_compiled(samples, setup)


def correct_compiled(samples: SampleTrack, setup: Setup) -> CorrectedTrack:
    """Correct as `correct` does, always by the compiled loop."""
    corrected = np.empty((len(CorrectedSample._fields), samples.stamps.size))
    if samples.stamps.size == 0:
        return CorrectedTrack(samples.stamps, corrected)
    coefficients = derive(setup)
    first = Sample(*samples.columns[:, 0].tolist())
    state, corrected[:, 0] = correction.start(first, coefficients)
    correction_kernel()(samples.columns, coefficients, state, corrected)
    return CorrectedTrack(samples.stamps, corrected)


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
    if size > 0 and _stays_interpreted(entry, lambda: filter_kernel(entry), size):
        try:
            return _interpret(entry, parameters, corrected, robot, state)
        except (ArithmeticError, ValueError):
            pass  # where a filter diverges, Python raises what compiled code turns into inf or nan
    if is_ours(entry):
        return run_compiled(entry, parameters, corrected, robot, state)
    from ..compilation import NOT_COMPILABLE

    try:
        return run_compiled(entry, parameters, corrected, robot, state)
    except NOT_COMPILABLE:
        return _interpret(entry, parameters, corrected, robot, state)


def _interpret(
    entry: Filter, parameters: Any, corrected: CorrectedTrack, robot: Robot, state: Any | None
) -> EstimateTrack:
    running = TiltFilter(entry, parameters._asdict(), robot, state)
    with np.errstate(all="ignore"):
        found = [running.step(CorrectedSample(*column)) for column in corrected.columns.T.tolist()]
    return EstimateTrack(corrected.stamps, np.array(found).T.copy(), running.state)


def run_compiled(
    entry: Filter, parameters: Any, corrected: CorrectedTrack, robot: Robot, state: Any | None
) -> EstimateTrack:
    """Run a filter as `run_filter` does, always by the compiled loop."""
    estimates = np.zeros((len(TiltEstimate._fields), corrected.stamps.size))
    if corrected.stamps.size == 0:
        return EstimateTrack(corrected.stamps, estimates, state)
    coefficients = entry.derive(parameters, robot)
    first = 0
    if state is None:
        sample = corrected.first
        state = entry.reset(TiltEstimate(sample.angle, sample.gyro_y), sample, coefficients)
        _store(state, estimates)
        first = 1
    state = filter_kernel(entry)(corrected.columns, first, coefficients, state, estimates)
    return EstimateTrack(corrected.stamps, estimates, state)


def _store(state: Any, estimates: FloatArray) -> None:
    for row, name in enumerate(TiltEstimate._fields):
        estimates[row, 0] = getattr(state, name, 0.0)


def _stays_interpreted(loop: Any, kernel: Callable[[], Any], samples: int) -> bool:
    """Return whether a loop over so many samples more is quicker done without compiling it."""
    from ..compilation import is_ready

    if is_ready(kernel()):
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
    for entry, _ in chosen:
        filter_kernel(entry)  # prepared one after the other; compiled loops then run side by side

    def run(each: tuple[Filter, Any]) -> EstimateTrack:
        return run_filter(*each, corrected, robot)

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
