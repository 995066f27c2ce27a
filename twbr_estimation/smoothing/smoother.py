"""A whole recording smoothed: forward and back, block by block.

Covariances of ten minutes would fill a gigabyte. The forward pass therefore keeps its state
every `BLOCK` windows only, and is repeated from there for the backward sweep.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..batch import CorrectedTrack
from ..errors import RecordingError
from ..filters import filter_named
from ..filters.inertial.error_state import ATTITUDE, STATES, Array
from ..filters.inertial.navigation import repaired
from ..filters.inertial.parameters import Coefficients
from ..filters.ins_odometer import State, reset
from ..recording import FloatArray, StampArray, TiltTrack
from ..robot import Robot
from ..samples import RESTART_GAP, CorrectedSample, TiltEstimate
from .backward import final_state
from .forward import Pass, empty_tape, started
from .kernels import Hindsight, forward_kernel, spread_kernel, sweep_kernel

SMOOTHER = "ins_odometer"
"""Filter whose model is smoothed, and by whose parameters."""
BLOCK = 1024
"""Windows whose covariances are in memory at a time."""
MOST_PASSES = 4
"""A further pass starts at the attitude that the one before has found for the start."""
FAR = 0.02
"""A start this wrong [rad] is worth it: equations made linear there are no longer true."""

Progress = Callable[[float], None]
"""Takes the share that is done, 0 to 1."""


@dataclass(frozen=True, slots=True)
class SmoothedTrack:
    """The tilt with hindsight, at every sample."""

    stamps: StampArray
    """Header stamps [ns], (n,)."""
    tilt: FloatArray
    """Tilt [rad], (n,)."""
    variance: FloatArray
    """Its variance as the filter's parameters have it, the mounting's included [rad^2], (n,)."""

    @property
    def deviation(self) -> float:
        """Root mean square of what the tilt may be off by its own account [rad]."""
        return math.sqrt(float(np.mean(self.variance)))

    def as_track(self) -> TiltTrack:
        """Return it as a reference."""
        return TiltTrack(self.stamps, self.tilt)


def smooth(
    corrected: CorrectedTrack,
    robot: Robot,
    values: Mapping[str, float] | None = None,
    progress: Progress = lambda share: None,
) -> SmoothedTrack:
    """Return the tilt with hindsight.

    Args:
        corrected: n samples.
        robot: its geometry.
        values: parameters of `ins_odometer`; missing ones take their defaults.
        progress: called as the work goes on.

    Raises:
        ConfigurationError: a parameter that does not exist or is out of bounds.
        RecordingError: there are fewer than two samples.
    """
    if corrected.stamps.size < 2:
        raise RecordingError(f"{corrected.stamps.size} samples cannot be smoothed")
    entry = filter_named(SMOOTHER)
    c = entry.derive(entry.configure(values), robot)
    tilt, variance = np.empty(corrected.stamps.size), np.empty(corrected.stamps.size)
    starts = [0, *(np.flatnonzero(corrected.field("dt") > RESTART_GAP)), corrected.stamps.size]
    for begin, end in pairwise(starts):
        part = _Part(np.ascontiguousarray(corrected.columns[:, begin:end]), c)

        def report(share: float, begin: int = begin, end: int = end) -> None:
            progress((begin + share * (end - begin)) / corrected.stamps.size)

        tilt[begin:end], variance[begin:end] = part.smoothed(report)
    variance += c.mounting_variance
    return SmoothedTrack(corrected.stamps, tilt, variance)


class _Part:
    """A recording without a gap, while it is smoothed."""

    def __init__(self, columns: FloatArray, c: Coefficients) -> None:
        n = columns.shape[1]
        self.columns, self.coefficients = columns, c
        self.tape = empty_tape(min(BLOCK, n))
        self.ends = np.zeros(n, dtype=np.int64)
        """Sample with which each window ends; there are at most as many windows as samples."""
        self.attitude = np.empty((n, 4))
        """Attitude at every sample before measurements."""
        self.hindsight = Hindsight(np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n))

    def smoothed(self, report: Progress) -> tuple[FloatArray, FloatArray]:
        """Return tilt [rad] and its variance [rad^2], (n,) each."""
        sample = CorrectedSample(*(float(value) for value in self.columns[:, 0]))
        start = reset(TiltEstimate(sample.angle, sample.gyro_y), sample, self.coefficients)
        for each in range(MOST_PASSES):
            windows, error = self._pass(start, partial(_part_of, report, each))
            if math.hypot(error[ATTITUDE], error[ATTITUDE + 1]) < FAR:
                break
            start = restarted(start, error)
        report(1.0)
        tilt, variance = np.empty(self.columns.shape[1]), np.empty(self.columns.shape[1])
        spread_kernel()(
            self.columns, self.attitude, self.ends[:windows], self.hindsight, tilt, variance
        )
        # The navigation is where the gyro is, which lags.
        times = np.cumsum(self.columns[0])
        tilt = np.interp(times + self.coefficients.gyro_delay, times, np.unwrap(tilt))
        return tilt, variance

    def _pass(self, start: State, report: Progress) -> tuple[int, Array]:
        """Go forward and back; return the windows, and the start's error."""
        checkpoints, end = self._forward(start)
        windows, later, error = end, final_state(), np.zeros(STATES)
        report(0.3)
        for count, checkpoint in enumerate(reversed(checkpoints)):
            begin = checkpoint.window
            if begin == 0:
                started(start, self.tape, 0)
            self._block(checkpoint)
            later, error = sweep_kernel()(
                self.tape, begin, end, self.attitude, self.ends, later, self.hindsight
            )
            end = begin
            report(0.3 + 0.7 * (count + 1) / len(checkpoints))
        return windows, error

    def _forward(self, start: State) -> tuple[list[_Checkpoint], int]:
        """Return where each block begins, and the number of windows."""
        self.attitude[0] = start.navigation.attitude
        next_one = _Checkpoint(1, 0, started(start, self.tape, 0))
        checkpoints: list[_Checkpoint] = []
        while not checkpoints or next_one.sample < self.columns.shape[1]:
            checkpoints.append(next_one)
            next_one = self._block(next_one)
        return checkpoints, next_one.window

    def _block(self, begin: _Checkpoint) -> _Checkpoint:
        """Run over one block and return where the next begins."""
        return _Checkpoint(
            *forward_kernel()(
                self.columns,
                begin.sample,
                begin.window,
                self.coefficients,
                begin.passed,
                self.tape,
                self.attitude,
                self.ends,
            )
        )


class _Checkpoint(NamedTuple):
    """State at the begin of a block."""

    sample: int
    """The first sample to take in."""
    window: int
    """The first window of the block; window 0 is the start itself."""
    passed: Pass


def _part_of(report: Progress, done: int, share: float) -> None:
    """Report the share of one pass: each takes most of what was left, as it may be the last."""
    report(1.0 - 0.1**done * (1.0 - 0.9 * share))


def restarted(start: State, error: Array) -> State:
    """Return a start that leans as it turned out to.

    Biases and gains stay what they were: found once more from the same readings they would
    count twice.
    """
    only = np.zeros(STATES)
    only[ATTITUDE : ATTITUDE + 2] = error[ATTITUDE : ATTITUDE + 2]
    return start._replace(navigation=repaired(start.navigation, only))
