"""Whole recordings at once: the live step functions, compiled.

The functions a node interprets are the ones compiled here, so there is one copy of every
algorithm.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from .compilation import compiled, source_version
from .filters.base import Filter, filter_named
from .pipeline import correction
from .pipeline.oversampling import Oversampler
from .pipeline.pairing import SampleTrack, pair
from .recording import FloatArray, Recording, StampArray
from .robot import Robot, Setup
from .samples import RESTART_GAP, CorrectedSample, Sample, TiltEstimate

SOURCES = ("samples.py", "pipeline/*.py", "plants/*.py", "filters/**/*.py")
"""What the compiled loops are made of, beside this file."""


@dataclass(frozen=True, slots=True)
class CorrectedTrack:
    """Corrected samples as columns."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    columns: FloatArray
    """The fields of `CorrectedSample` as rows, (27, n)."""

    def field(self, name: str) -> FloatArray:
        """Return one field of `CorrectedSample` over time, (n,)."""
        row: FloatArray = self.columns[CorrectedSample._fields.index(name)]
        return row

    @property
    def first(self) -> CorrectedSample:
        """The first sample."""
        return CorrectedSample(*self.columns[:, 0].tolist())


@dataclass(frozen=True, slots=True)
class EstimateTrack:
    """Estimates of one filter as columns."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    columns: FloatArray
    """The fields of `TiltEstimate` as rows, (4, n)."""
    state: Any
    """The filter's state after the last sample, to go on from."""

    @property
    def tilt(self) -> FloatArray:
        """Tilt [rad], (n,)."""
        row: FloatArray = self.columns[0]
        return row

    @property
    def rate(self) -> FloatArray:
        """Tilt rate [rad/s], (n,)."""
        row: FloatArray = self.columns[1]
        return row

    @property
    def gyro_bias(self) -> FloatArray:
        """Gyro bias [rad/s], (n,); zeros where the filter has none."""
        row: FloatArray = self.columns[2]
        return row

    @property
    def tilt_variance(self) -> FloatArray:
        """Variance of the tilt [rad^2], (n,); zeros where unknown."""
        row: FloatArray = self.columns[3]
        return row


def correct(samples: SampleTrack, setup: Setup) -> CorrectedTrack:
    """Correct a whole track, as `correction.Corrector` would sample by sample.

    Args:
        samples: n paired samples.
        setup: robot, calibration and settings.

    Returns:
        n corrected samples.
    """
    corrected = np.empty((len(CorrectedSample._fields), samples.stamps.size))
    if samples.stamps.size > 0:
        coefficients = correction.derive(setup)
        first = Sample(*samples.columns[:, 0].tolist())
        state, corrected[:, 0] = correction.start(first, coefficients)
        _correction_kernel()(samples.columns, coefficients, state, corrected)
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
    kernel = filter_kernel(entry)
    state = kernel(corrected.columns, first, coefficients, state, estimates)
    return EstimateTrack(corrected.stamps, estimates, state)


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


def estimate_recording(
    recording: Recording,
    setup: Setup,
    settings: Mapping[str, Mapping[str, float]],
    loop_period: float = 0.0,
) -> dict[str, EstimateTrack]:
    """Correct a recording once and run several filters over it.

    Args:
        recording: IMU and, where there are any, wheels and motors.
        setup: robot, calibration and correction settings.
        settings: parameter values by filter name; missing ones take their defaults.
        loop_period: period [s] for which the corrected samples are combined; 0 takes each.

    Raises:
        ConfigurationError: an unknown filter or parameter, or a value out of bounds.
    """
    chosen = [(filter_named(name), values) for name, values in settings.items()]
    ready = [(entry, entry.configure(values)) for entry, values in chosen]
    samples = pair(recording.imu, recording.wheels, motors=recording.motors)
    corrected = correct(samples, setup)
    if loop_period > 0.0:
        corrected = oversampled(corrected, loop_period)
    for entry, _ in ready:
        filter_kernel(entry)  # prepared one after the other; compiled loops then run side by side

    def run(each: tuple[Filter, Any]) -> EstimateTrack:
        return run_filter(*each, corrected, setup.robot)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tracks = list(pool.map(run, ready))
    return {entry.name: track for (entry, _), track in zip(ready, tracks, strict=True)}


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


def _store(state: Any, estimates: FloatArray) -> None:
    for row, name in enumerate(TiltEstimate._fields):
        estimates[row, 0] = getattr(state, name, 0.0)


@cache
def _correction_kernel() -> Any:
    start, step = correction.start, correction.step

    def run(samples: Any, coefficients: Any, state: Any, corrected: Any) -> None:
        for i in range(1, samples.shape[1]):
            sample = raw_sample_at(samples, i)
            if sample.dt > RESTART_GAP:
                state, result = start(sample, coefficients)
            else:
                state, result = step(state, sample, coefficients)
            for field in range(len(result)):
                corrected[field, i] = result[field]

    return compiled(run, source_version(SOURCES), raw_sample_at, start, step)


@cache
def filter_kernel(entry: Filter) -> Any:
    """Return the compiled loop of a filter over corrected columns.

    It takes (columns, first, coefficients, state, estimates), fills `estimates` from index
    `first` on and returns the last state.
    """
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

    return compiled(run, source_version(SOURCES), sample_at, step, reset)
