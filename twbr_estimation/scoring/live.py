"""The error of live estimates against a live reference, with the figures of `evaluation`.

Estimates wait until the reference has passed their stamp; then they are compared exactly as
a recording is, block by block. Only sums and the last `HISTORY` seconds are kept, so that
it can run for days.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recording import FloatArray, StampArray, TiltTrack
from ..samples import RESTART_GAP
from .score import (
    Association,
    ErrorSums,
    RecordingScore,
    Score,
    ScoringOptions,
    delay_of,
    errors_of,
)

HISTORY = 60.0
"""The delay is found over this last stretch of time [s]."""
FEWEST = 20
"""Values from which on the time between two of them is known."""
_HISTORY = round(HISTORY * 1e9)
_RESTART = round(RESTART_GAP * 1e9)


class TiltBuffer:
    """Tilts of one source: those that just came, and those of the last `HISTORY` seconds."""

    def __init__(self) -> None:
        """Start empty."""
        self.refused = 0
        """Values that were not finite, or whose stamp was not after the one before."""
        self.missing = 0
        """Values for which steps of the stamps have room, as where messages were lost."""
        self.last_stamp: int | None = None
        self.stamps: StampArray = np.empty(0, dtype=np.int64)
        self.tilt: FloatArray = np.empty(0)
        self._fresh: list[tuple[int, float]] = []

    def add(self, stamp: int, tilt: float) -> None:
        """Take one value; `stamp` [ns], `tilt` [rad]. One of another pass replaces all."""
        if self.is_of_another_pass(stamp):
            self._fresh = []
            self.stamps, self.tilt = self.stamps[:0], self.tilt[:0]
            self.last_stamp = None
        if not math.isfinite(tilt) or (self.last_stamp is not None and stamp <= self.last_stamp):
            self.refused += 1
            return
        self.last_stamp = stamp
        self._fresh.append((stamp, tilt))

    def is_of_another_pass(self, stamp: int) -> bool:
        """Whether `stamp` [ns] is more than `RESTART_GAP` before the last one."""
        return self.last_stamp is not None and stamp < self.last_stamp - _RESTART

    def merge(self) -> None:
        """Put what came into `stamps` and `tilt`, and drop what is older than `HISTORY`."""
        if not self._fresh:
            return
        stamps, tilt = zip(*self._fresh, strict=True)
        self._fresh = []
        known = max(self.stamps.size - 1, 0)
        self.stamps = np.concatenate([self.stamps, np.array(stamps, dtype=np.int64)])
        self.missing += _missing(self.stamps, known)
        self.tilt = np.concatenate([self.tilt, np.array(tilt, dtype=np.float64)])
        first = int(np.searchsorted(self.stamps, self.stamps[-1] - _HISTORY))
        self.stamps, self.tilt = self.stamps[first:], self.tilt[first:]


def _missing(stamps: StampArray, known: int) -> int:
    """Return for how many values the steps from the stamp of index `known` on have room."""
    steps = np.diff(stamps)
    if steps.size < FEWEST:
        return 0
    usual = float(np.mean(steps[steps < 1.5 * np.median(steps)]))
    room = np.rint(steps[known:] / usual) - 1.0
    return int(np.sum(room[room > 0.0]))


class _Estimator:
    """One estimator: its values, how far they are scored, and its errors."""

    def __init__(self) -> None:
        self.values = TiltBuffer()
        self.sums = ErrorSums()
        self.scored_to = -(2**62)  # [ns]

    def waiting(self, until: int) -> NDArray[np.bool_]:
        """Return which values are not scored yet and stamped up to `until` [ns]."""
        stamps = self.values.stamps
        return np.asarray((stamps > self.scored_to) & (stamps <= until))


class LiveEvaluation:
    """Scores any number of estimators while estimates and reference arrive."""

    def __init__(self, options: ScoringOptions | None = None, source: str = "live") -> None:
        """Start without an estimator.

        Args:
            options: how to compare; `skip` counts from the first estimate.
            source: what to call the stream in the scores.
        """
        self._options = options or ScoringOptions()
        self._source = source
        self._reference = TiltBuffer()
        self._estimators: dict[str, _Estimator] = {}
        self._first: int | None = None

    @property
    def refused(self) -> Mapping[str, int]:
        """Values not used, by source, because they were not finite or not after the last."""
        buffers = {name: entry.values for name, entry in self._estimators.items()}
        buffers["reference"] = self._reference
        return {name: buffer.refused for name, buffer in buffers.items() if buffer.refused}

    @property
    def missing(self) -> Mapping[str, int]:
        """Values that steps of the stamps have room for, by source."""
        buffers = {name: entry.values for name, entry in self._estimators.items()}
        buffers["reference"] = self._reference
        return {name: buffer.missing for name, buffer in buffers.items() if buffer.missing}

    def ends_before(self, stamp: int) -> bool:
        """Whether a reference of this stamp [ns] is the first of another pass.

        The recording is over then: take its `result` and begin another evaluation.
        """
        return self._reference.is_of_another_pass(stamp)

    def add_reference(self, stamp: int, tilt: float) -> None:
        """Take the reference at `stamp` [ns]: `tilt` [rad]."""
        self._reference.add(stamp, tilt)

    def add_estimate(self, name: str, stamp: int, tilt: float) -> None:
        """Take the estimate of `name` at `stamp` [ns]: `tilt` [rad]."""
        estimator = self._estimators.get(name)
        if estimator is None:
            estimator = self._estimators[name] = _Estimator()
        if estimator.values.is_of_another_pass(stamp):
            self.update()
            estimator.scored_to = -(2**62)
        if self._first is None or stamp < self._first:
            self._first = stamp
        estimator.values.add(stamp, tilt)

    def update(self, at_end: bool = False) -> None:
        """Score the estimates that the reference has passed; all of them `at_end`."""
        for estimator in self._estimators.values():
            estimator.values.merge()
        association = self._association()
        if association is None:
            return
        until = int(self._reference.stamps[-1]) + round(self._options.reference_delay * 1e9)
        for estimator in self._estimators.values():
            self._score(estimator, association, 2**62 if at_end else until)

    def scores(self, delays: bool = True) -> dict[str, Score]:
        """Return the figures so far of every estimator that has been compared at all.

        Args:
            delays: whether to find the delays, which costs more than all the rest; 0 if not.
        """
        association = self._association()
        if association is None:
            return {}
        return {
            name: estimator.sums.score(self._delay(estimator, association) if delays else 0.0)
            for name, estimator in self._estimators.items()
            if estimator.sums.samples > 0
        }

    def problems(self) -> tuple[str, ...]:
        """Return why estimators that have sent something have not been compared."""
        reference, found = self._reference.last_stamp, []
        for name, estimator in self._estimators.items():
            last = estimator.values.last_stamp
            if estimator.sums.samples > 0 or reference is None:
                continue
            if last is None:
                found.append(f"{name}: not one of its tilts is a number")
            elif abs(last - reference) > _RESTART:
                ahead = (last - reference) * 1e-9
                found.append(f"{name}: its stamps are {ahead:+.3f} s from the reference's")
        return tuple(found)

    def result(self) -> RecordingScore:
        """Return the scores in the form of an evaluated recording.

        Raises:
            RecordingError: nothing has been compared.
        """
        self.update(at_end=True)
        scores = self.scores()
        if not scores:
            raise RecordingError(f"{self._source}: no estimate has been compared with a reference")
        longest = max(self._estimators.values(), key=lambda each: each.sums.samples)
        periods = np.diff(longest.values.stamps) * 1e-9
        return RecordingScore(
            source=self._source,
            dt=float(np.median(periods)) if periods.size > 0 else 0.0,
            samples=longest.sums.samples + longest.sums.left_out,
            estimators=scores,
            repairs={
                **{f"{name}: values not used": n for name, n in self.refused.items()},
                **{
                    f"{name}: values missing between its stamps": n
                    for name, n in self.missing.items()
                },
            },
        )

    def _association(self) -> Association | None:
        self._reference.merge()
        if self._reference.stamps.size < 2:
            return None
        track = TiltTrack(self._reference.stamps, self._reference.tilt)
        return Association(track, self._options)

    def _score(self, estimator: _Estimator, association: Association, until: int) -> None:
        assert self._first is not None  # there is an estimator, so there was an estimate
        chosen = estimator.waiting(until)
        if not chosen.any():
            return
        stamps, tilt = estimator.values.stamps[chosen], estimator.values.tilt[chosen]
        first = self._first + round(self._options.skip * 1e9)
        errors, _, left_out = errors_of(stamps, tilt, association.at(stamps), first)
        estimator.sums.add(errors, left_out)
        estimator.scored_to = int(stamps[-1])

    def _delay(self, estimator: _Estimator, association: Association) -> float:
        """Find the delay over the scored part of the history."""
        assert self._first is not None
        values = estimator.values
        inside = values.stamps <= estimator.scored_to
        stamps, tilt = values.stamps[inside], values.tilt[inside]
        first = self._first + round(self._options.skip * 1e9)
        _, known, _ = errors_of(stamps, tilt, association.at(stamps), first)
        return delay_of(stamps[known], tilt[known], association) if known.any() else 0.0
