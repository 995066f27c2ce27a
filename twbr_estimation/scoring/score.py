"""Error of an estimate against the reference encoder: Laddach 2022 (5) and related figures.

Estimate and reference are associated in time before anything is compared: the reference is
interpolated at the stamps of the estimate, and stamps that fall into a gap of the reference
or outside it are left out and counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..angles import wrapped
from ..errors import RecordingError
from ..parameters.bounds import Bounds, require_bounds
from ..recording import FloatArray, Recording, StampArray, TiltTrack
from .figure_table import FIGURES

LARGEST_REFERENCE_GAP = 0.1
"""Reference samples further apart than this [s], and than five periods, are a gap."""
LARGEST_TILT = 1e6
"""An estimate beyond it [rad] has diverged."""
SMOOTHED = "smoothed"
"""Name of the tilt that a whole recording gives with hindsight."""
_GAP_PERIODS = 5.0
_DELAY_ITERATIONS = 4
_DELAY_SAMPLES = 5_000
_LARGEST_DELAY = 0.5  # [s]; beyond it a linearised search means nothing


@dataclass(frozen=True, slots=True)
class ScoringOptions:
    """Settings of the comparison with the reference.

    Raises:
        ConfigurationError: a value that is no number, or out of bounds.
    """

    reference_delay: Annotated[
        float, Bounds(-1e6, 1e6, "s", "An estimate at t is compared with the reference at t - it")
    ] = 0.0
    reference_offset: Annotated[float, Bounds(-100.0, 100.0, "rad", "Added to the reference")] = 0.0
    skip: Annotated[float, Bounds(0.0, 1e6, "s", "Time at the start that is not scored")] = 0.0

    def __post_init__(self) -> None:
        require_bounds(self)


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of one estimator on one recording; the errors are estimate minus reference."""

    mse_deg2: float
    """Mean square error, Laddach 2022 (5) [deg^2]."""
    rmse_deg: float
    """Root of the mean square error [deg]."""
    bias_deg: float
    """Mean error [deg]."""
    max_abs_deg: float
    """Largest error [deg]."""
    delay_s: float
    """Lag of the estimate behind the reference [s]; 0 where nothing moved."""
    samples: int
    """Samples compared."""
    left_out: int
    """Samples without a reference: before, after, or in a gap of it."""


@dataclass(frozen=True, slots=True)
class RecordingScore:
    """All estimators' scores on one recording."""

    source: str
    dt: float
    """Median sampling period [s]."""
    samples: int
    """IMU samples in the recording."""
    estimators: Mapping[str, Score]
    repairs: Mapping[str, int] = field(default_factory=dict)
    """Repairs of the recording."""
    warnings: Sequence[str] = ()
    """Warnings about these figures, those of the findings among them."""
    findings: Sequence[Mapping[str, Any]] = ()
    """Warnings and failures of the checks, the worst first, in the form of `twbr check --json`."""
    reference: str = "encoder"
    """Reference of the errors: the encoder, or SMOOTHED where the recording has none."""
    wheels_ignored_s: Mapping[str, float] = field(default_factory=dict)
    """Time for which wheels were ignored [s], by name of each filter that checks them."""
    smoothed_deviation_deg: float | None = None
    """Stated uncertainty of the smoothed tilt, rms [deg]; None without one."""

    def __str__(self) -> str:
        """Return the table that `twbr evaluate` prints."""
        from .table import as_text

        return as_text([self])

    def to_columns(self) -> dict[str, list[Any]]:
        """Return the figures as one list a column: `estimator`, then the fields of `Score`."""
        names = [each.name for each in fields(Score)]
        table = {name: [getattr(each, name) for each in self.estimators.values()] for name in names}
        return {"estimator": list(self.estimators), **table}


class ReferenceAt(NamedTuple):
    """A reference at n stamps."""

    tilt: FloatArray
    """[rad], (n,)."""
    known: NDArray[np.bool_]
    """Whether there is one, (n,); false before, after and in gaps of it."""


class Association:
    """A reference, ready to be compared with estimates at any stamps."""

    def __init__(self, reference: TiltTrack, options: ScoringOptions | None = None) -> None:
        """Prepare `reference`.

        Raises:
            RecordingError: the reference holds fewer than two samples.
        """
        if reference.stamps.size < 2:
            raise RecordingError(
                f"the reference holds {reference.stamps.size} samples; at least 2 are needed"
            )
        self._options = options or ScoringOptions()
        self._times = reference.stamps
        self._tilt = np.unwrap(reference.tilt) + self._options.reference_offset
        self._periods = np.diff(self._times)
        usual = float(np.median(self._periods)) * 1e-9
        limit = max(LARGEST_REFERENCE_GAP, _GAP_PERIODS * usual)
        self._gap_after = self._periods > limit * 1e9

    def at(self, stamps: StampArray) -> ReferenceAt:
        """Return the reference at t - delay for each stamp t [ns], (n,), increasing."""
        times = stamps - round(self._options.reference_delay * 1e9)
        after = np.clip(np.searchsorted(self._times, times), 1, self._times.size - 1)
        before = after - 1
        since = times - self._times[before]
        period = self._periods[before]
        exact = (since == 0) | (since == period)
        known = (since >= 0) & (since <= period) & (exact | ~self._gap_after[before])
        share = np.clip(since / period, 0.0, 1.0)
        tilt = self._tilt[before] + share * (self._tilt[after] - self._tilt[before])
        return ReferenceAt(tilt, known)


class ErrorSums:
    """Errors of one estimator, summed as they come; the figures of a `Score` at any time."""

    def __init__(self) -> None:
        """Start without an error."""
        self.samples = 0
        """Samples compared."""
        self.left_out = 0
        """Samples without a reference."""
        self._sum = self._square_sum = self._largest = 0.0

    def add(self, errors: FloatArray, left_out: int) -> None:
        """Add errors [rad], (n,), and the number of samples without a reference."""
        self.samples += errors.size
        self.left_out += left_out
        if errors.size > 0:
            degrees = np.degrees(errors)
            self._sum += float(degrees.sum())
            self._square_sum += float(np.square(degrees).sum())
            self._largest = max(self._largest, float(np.abs(degrees).max()))

    def score(self, delay: float) -> Score:
        """Return the figures so far; `delay` is how much the estimate lags [s].

        Raises:
            RecordingError: there is no error yet.
        """
        if self.samples == self.left_out == 0:
            raise RecordingError("no sample is left to compare; check the skipped time")
        if self.samples == 0:
            raise RecordingError(
                f"estimate and reference do not overlap: of {self.left_out} samples none has a "
                "reference; check the reference's stamps, its delay and the skipped time"
            )
        mse = self._square_sum / self.samples
        return Score(
            mse_deg2=mse,
            rmse_deg=math.sqrt(mse),
            bias_deg=self._sum / self.samples,
            max_abs_deg=self._largest,
            delay_s=delay,
            samples=self.samples,
            left_out=self.left_out,
        )


def errors_of(
    stamps: StampArray, tilt: FloatArray, reference: ReferenceAt, first_stamp: int
) -> tuple[FloatArray, NDArray[np.bool_], int]:
    """Return an estimate's errors where there is a reference.

    Args:
        stamps: the estimate's stamps [ns], (n,).
        tilt: the estimate [rad], (n,).
        reference: the reference at these stamps.
        first_stamp: estimates before it [ns] are not scored.

    Returns:
        k errors [rad] within +-pi; which of the n samples they belong to; how many others
        lack a reference.
    """
    scored = stamps >= first_stamp
    known = reference.known & scored
    error = wrapped(tilt[known] - reference.tilt[known])
    return error, known, int((scored & ~reference.known).sum())


def score(
    stamps: StampArray,
    tilt: FloatArray,
    association: Association,
    first_stamp: int,
    reference: ReferenceAt | None = None,
) -> Score:
    """Compare an estimate with the reference.

    Args:
        stamps: the estimate's stamps [ns], (n,).
        tilt: the estimate [rad], (n,).
        association: the reference.
        first_stamp: estimates before it [ns] are not scored.
        reference: the reference at these stamps, where it is known already.

    Raises:
        RecordingError: estimate and reference have no sample in common.
    """
    sums, known = _summed(stamps, tilt, reference or association.at(stamps), first_stamp)
    return sums.score(delay_of(stamps[known], tilt[known], association) if sums.samples else 0.0)


def mean_square_error(
    stamps: StampArray, tilt: FloatArray, reference: ReferenceAt, first_stamp: int
) -> float:
    """Return the mean square error [deg^2]; the arguments are those of `errors_of`.

    Raises:
        RecordingError: estimate and reference have no sample in common.
    """
    sums, _ = _summed(stamps, tilt, reference, first_stamp)
    return sums.score(0.0).mse_deg2


def _summed(
    stamps: StampArray, tilt: FloatArray, reference: ReferenceAt, first_stamp: int
) -> tuple[ErrorSums, NDArray[np.bool_]]:
    """Return the summed errors, and which samples they belong to."""
    errors, known, left_out = errors_of(stamps, tilt, reference, first_stamp)
    sums = ErrorSums()
    sums.add(errors, left_out)
    return sums, known


def delay_of(stamps: StampArray, tilt: FloatArray, association: Association) -> float:
    """Return how much an estimate lags behind the reference [s]; 0 where nothing moved.

    The lag that fits best, by Gauss-Newton on the linearised reference.

    Args:
        stamps: the estimate's stamps [ns], (n,), n above 0.
        tilt: the estimate [rad], (n,).
        association: the reference.
    """
    chosen = stamps[:: max(1, stamps.size // _DELAY_SAMPLES)]
    wanted = tilt[:: max(1, stamps.size // _DELAY_SAMPLES)]
    half = 5_000_000  # [ns]; the slope of the reference is taken over 10 ms
    delay = 0.0
    for _ in range(_DELAY_ITERATIONS):
        shifted = chosen - round(delay * 1e9)
        (value, known), (earlier, k1), (later, k2) = (
            association.at(shifted + offset) for offset in (0, -half, half)
        )
        use = known & k1 & k2
        slope = (later - earlier)[use] / (2e-9 * half)
        error = wrapped(wanted - value)[use]
        power = float(np.mean((slope - slope.mean()) ** 2)) if use.any() else 0.0
        if power < 1e-6:
            return 0.0
        delay -= float(np.mean((error - error.mean()) * (slope - slope.mean()))) / power
        delay = min(max(delay, -_LARGEST_DELAY), _LARGEST_DELAY)
    return delay


def score_recording(
    recording: Recording,
    estimates: Mapping[str, TiltTrack],
    options: ScoringOptions | None = None,
    warnings: Sequence[str] = (),
    association: Association | None = None,
) -> RecordingScore:
    """Score several estimators on one recording.

    Args:
        recording: gives the reference, and the start from which time is skipped.
        estimates: tilt over time by name of the estimator.
        options: how to compare.
        warnings: passed on.
        association: the reference with these options, where it is prepared already.

    Raises:
        RecordingError: there is no reference, it overlaps with no estimate, or all diverge.
    """
    if recording.reference is None:
        raise RecordingError(f"{recording.source}: there is no reference to compare with")
    options = options or ScoringOptions()
    first = int(recording.imu.stamps[0]) + round(options.skip * 1e9)
    finite, found = finite_only(estimates, int(recording.imu.stamps[0]))
    scores, name, stamps, reference = {}, "reference", np.empty(0, dtype=np.int64), None
    try:
        association = association or Association(recording.reference, options)
        for name, track in finite.items():
            if track.stamps is not stamps:  # filters share them, and so the reference there
                stamps, reference = track.stamps, association.at(track.stamps)
            scores[name] = score(stamps, track.tilt, association, first, reference)
    except RecordingError as error:
        raise RecordingError(f"{recording.source}: {name}: {error}") from None
    if found and not scores:
        raise RecordingError(f"{recording.source}: {'; '.join(found)}")
    return RecordingScore(
        source=recording.source,
        dt=recording.dt,
        samples=int(recording.imu.stamps.size),
        estimators=scores,
        repairs=recording.repairs,
        warnings=(*warnings, *found),
    )


def finite_only(
    estimates: Mapping[str, TiltTrack], start: int
) -> tuple[dict[str, TiltTrack], list[str]]:
    """Return the estimates that stay finite, and warnings about the others.

    Args:
        estimates: tilt over time by name of the estimator.
        start: stamp from which the warnings count the time [ns].
    """
    kept, found = {}, []
    for name, track in estimates.items():
        wild = ~(np.abs(track.tilt) < LARGEST_TILT)
        if not wild.any():
            kept[name] = track
            continue
        since = float(track.stamps[int(np.argmax(wild))] - start) * 1e-9
        found.append(f"{name}: diverges; it is no angle from {since:.3f} s on and left out")
    return kept, found


def mean_over(recordings: Sequence[RecordingScore]) -> dict[str, dict[str, float]]:
    """Return every figure's mean over the recordings, for estimators that are in all."""
    names = [
        name
        for name in (recordings[0].estimators if recordings else ())
        if all(name in recording.estimators for recording in recordings)
    ]
    return {
        name: {
            each.name: float(np.mean([getattr(r.estimators[name], each.name) for r in recordings]))
            for each in FIGURES
        }
        for name in names
    }


def as_json(recordings: Sequence[RecordingScore]) -> dict[str, object]:
    """Return the scores in the form that `twbr evaluate --json` writes."""
    return {
        "recordings": [
            {
                **{key: value for key, value in asdict(entry).items() if key != "estimators"},
                "estimators": {name: asdict(value) for name, value in entry.estimators.items()},
            }
            for entry in recordings
        ],
        "mean": mean_over(recordings),
    }
