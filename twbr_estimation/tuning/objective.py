"""Objective of tuning: the mean square error, with or without a price on lag and noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..angles import wrapped
from ..batch import CorrectedTrack, correct
from ..drives import Drive
from ..errors import ConfigurationError, RecordingError
from ..pipeline.pairing import SampleTrack
from ..recording import FloatArray, StampArray
from ..robot import CorrectionSettings, Setup
from ..scoring.score import Association

BoolArray = NDArray[np.bool_]

SLOPE_HALF_WIDTH = 0.01
"""The reference's rate is its difference over twice this [s]: one sample shows its counts only."""
LONGEST_STEP = 1.5
"""Samples further apart than this many usual periods have a hole between them."""
BEGINNING = 0.25
"""Share of a recording that decides which points over the bounds a search refines."""
_WEIGHTS = {"delay": 0.01, "roughness": 1e-4}
_DEGREES_SQUARED = math.degrees(1.0) ** 2


@dataclass(frozen=True, slots=True)
class Objective:
    """The figure of merit; MSE alone as in Laddach 2022 where both weights are zero."""

    delay_weight: float = 0.0
    """Price of lag [deg^2/ms^2]: 0.01 makes 10 ms as bad as 1 deg^2 of MSE."""
    roughness_weight: float = 0.0
    """Price of noise [s^2]: the mean square error of the estimate's slope [(deg/s)^2] times this.
    """

    @staticmethod
    def parsed(text: str) -> Objective:
        """Return the objective of a text such as `mse`, `mse+delay`, `mse+delay=0.02+roughness`.

        Raises:
            ConfigurationError: another text, or a weight that is not above 0.
        """
        first, *prices = text.split("+")
        weights = {}
        for price in prices:
            name, equals, number = price.partition("=")
            try:
                weight = float(number) if equals else _WEIGHTS[name]
            except (KeyError, ValueError):
                weight = math.nan
            if name not in _WEIGHTS or f"{name}_weight" in weights or not 0.0 < weight < math.inf:
                first = ""
            weights[f"{name}_weight"] = weight
        if first != "mse":
            known = ", ".join(f"{name}={weight:g}" for name, weight in _WEIGHTS.items())
            raise ConfigurationError(
                f"objective {text!r}: expected mse, then +NAME or +NAME=WEIGHT with a weight "
                f"above 0; there are: {known}"
            )
        return Objective(**weights)

    def terms(
        self,
        error: FloatArray,
        tilt: FloatArray,
        slope: FloatArray,
        dt: float,
        joined: BoolArray | None = None,
    ) -> list[Term]:
        """Return what the figure is made of: mean squares [deg^2].

        Args:
            error: estimate minus reference [rad], (n,).
            tilt: the estimate [rad], (n,).
            slope: the reference's rate [rad/s], (n,).
            dt: sampling period [s].
            joined: which steps from one value to the next are a single period, (n - 1,); all by
                default. The others lie across a hole and are no roughness.
        """
        found = [Term(error, _DEGREES_SQUARED)]
        if self.roughness_weight > 0.0:
            rough = np.diff(tilt) / dt - 0.5 * (slope[1:] + slope[:-1])
            kept = rough if joined is None else rough[joined]
            if kept.size:
                found.append(Term(kept, self.roughness_weight * _DEGREES_SQUARED))
        if self.delay_weight > 0.0:
            power = float(np.sum(np.square(slope)))
            delay_ms = -1e3 * float(np.sum(error * slope)) / power if power > 0.0 else 0.0
            found.append(Term(np.array([delay_ms]), self.delay_weight))
        return found


class Term(NamedTuple):
    """A mean of squares in a figure."""

    errors: FloatArray
    weight: float
    """Of the mean of their squares."""


def figure_of(terms: Sequence[Term]) -> float:
    """Return the figure that terms add up to."""
    # No dot products: the linear algebra library's threads cost more than they save here.
    with np.errstate(over="ignore"):  # of what diverges
        return sum(weight * float(np.mean(np.square(each))) for each, weight in terms)


@dataclass(frozen=True, slots=True)
class TuningSet:
    """One recording, made ready for running filters on it many times."""

    source: str
    dt: float
    """Median sampling period [s]."""
    setup: Setup
    samples: SampleTrack
    corrected: CorrectedTrack
    reference: FloatArray
    """Reference at the stamps of the samples that have one [rad], (k,)."""
    known: slice | BoolArray
    """Index of the samples that have one: a slice where they follow each other."""
    slope: FloatArray
    """The reference's rate where it is known [rad/s], (k,)."""
    joined: BoolArray | None
    """Which follow the one before without a hole, both with a slope, (k - 1,); None: all do."""
    saturated: float
    """Share of samples with a saturated gyro or accelerometer."""

    @property
    def has_wheels(self) -> bool:
        """Whether any sample has a wheel reading."""
        return bool(np.any(self.samples.field("wheel_count") > 0.0))

    @property
    def beginning(self) -> TuningSet:
        """The first `BEGINNING` of it; all of it where too few samples have a reference there."""
        count = round(BEGINNING * self.samples.stamps.size)
        known = np.isin(np.arange(count), np.arange(self.samples.stamps.size)[self.known])
        kept = int(known.sum())
        if kept < 2:
            return self
        samples, corrected = (
            (track.stamps[:count], np.ascontiguousarray(track.columns[:, :count]))
            for track in (self.samples, self.corrected)
        )
        return replace(
            self,
            samples=SampleTrack(*samples),
            corrected=CorrectedTrack(*corrected),
            reference=self.reference[:kept],
            known=_index_of(known),
            slope=self.slope[:kept],
            joined=None if self.joined is None else self.joined[: kept - 1],
        )

    def corrected_with(self, settings: CorrectionSettings) -> TuningSet:
        """Return the set as other settings of the correction leave it."""
        setup = replace(self.setup, correction=settings)
        return replace(self, setup=setup, corrected=correct(self.samples, setup))

    def errors(self, tilt: FloatArray) -> FloatArray:
        """Return estimate minus reference [rad], (k,).

        Args:
            tilt: the estimate at the samples that have a reference [rad], (k,).
        """
        return wrapped(tilt - self.reference)


def prepare(drive: Drive) -> TuningSet:
    """Associate the samples of a recording with its reference, once.

    Raises:
        RecordingError: there is no reference, or it does not overlap with the samples.
    """
    association, samples = drive.association, drive.samples
    if association is None:
        raise RecordingError(
            f"{drive.source}: there is no reference to tune against; smoothing makes one (`smooth`)"
        )
    reference, covered = association.at(samples.stamps)
    begin = samples.stamps[:1] + round(drive.options.skip * 1e9)
    known = covered & (samples.stamps >= begin)
    if int(known.sum()) < 2:
        raise RecordingError(f"{drive.source}: fewer than 2 samples have a reference")
    slope, sloped = _slope(association, samples.stamps[known])
    return TuningSet(
        source=drive.source,
        dt=drive.recording.dt,
        setup=drive.setup,
        samples=samples,
        corrected=drive.corrected_samples,
        reference=reference[known],
        known=_index_of(known),
        slope=slope,
        joined=_joined(samples.stamps[known], sloped),
        saturated=_saturated(drive.corrected_samples),
    )


def _index_of(known: NDArray[np.bool_]) -> slice | NDArray[np.bool_]:
    """Return what picks the same elements, without copying them where they follow each other."""
    places = np.flatnonzero(known)
    following = slice(int(places[0]), int(places[-1]) + 1)
    return following if bool(known[following].all()) else known


def _joined(stamps: StampArray, sloped: BoolArray) -> BoolArray | None:
    """Return which steps are a usual period and have a slope; None where all do."""
    steps = np.diff(stamps)
    joined: BoolArray = (steps < LONGEST_STEP * np.median(steps)) & sloped[1:] & sloped[:-1]
    return None if bool(joined.all()) else joined


def _slope(association: Association, stamps: StampArray) -> tuple[FloatArray, BoolArray]:
    """Return the reference's rate [rad/s], 0 where it is not known, and where it is."""
    half = round(SLOPE_HALF_WIDTH * 1e9)
    (earlier, known), (later, also) = (association.at(stamps + offset) for offset in (-half, half))
    both = known & also
    return np.where(both, (later - earlier) / (2.0 * SLOPE_HALF_WIDTH), 0.0), both


def _saturated(corrected: CorrectedTrack) -> float:
    """Return the share of samples that are saturated in the plane of the tilt."""
    axes = ("gyro_saturated_y", "accel_saturated_x", "accel_saturated_z")
    return float(np.mean(np.any([corrected.field(axis) for axis in axes], axis=0)))
