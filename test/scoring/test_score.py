"""Association in time and the figures of a comparison."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twbr_estimation.errors import RecordingError
from twbr_estimation.recording import ImuTrack, Recording, TiltTrack
from twbr_estimation.scoring.score import (
    Association,
    ScoringOptions,
    as_json,
    score,
    score_recording,
)

SECOND = 1_000_000_000


def swing(time: np.ndarray) -> np.ndarray:
    """Return a smooth tilt [rad] at the given times [s]."""
    return 0.3 * np.sin(3.0 * time) + 0.1 * np.sin(11.0 * time + 1.0)


def track(time: np.ndarray, tilt: np.ndarray) -> TiltTrack:
    """Return a track stamped at the given times [s] after an arbitrary epoch."""
    return TiltTrack((time * 1e9).round().astype(np.int64) + 7 * SECOND, tilt)


REFERENCE_TIME = np.arange(0.0, 20.0, 0.0013)
REFERENCE = track(REFERENCE_TIME, swing(REFERENCE_TIME))
TIME = np.arange(1.0, 19.0, 0.0047)


def test_known_offset_and_noise_come_back() -> None:
    noise = np.random.default_rng(3).normal(0.0, math.radians(0.5), TIME.size)
    estimate = track(TIME, swing(TIME) + math.radians(2.0) + noise)
    result = score(estimate.stamps, estimate.tilt, Association(REFERENCE), 0)
    assert result.bias_deg == pytest.approx(2.0, abs=0.03)
    assert result.mse_deg2 == pytest.approx(4.0 + 0.25, rel=0.02)
    assert result.rmse_deg == pytest.approx(math.sqrt(result.mse_deg2))
    assert 2.5 < result.max_abs_deg < 5.0
    assert result.samples == TIME.size
    assert result.left_out == 0


@pytest.mark.parametrize("lag", [-0.02, 0.0, 0.0083, 0.1])
def test_delay_is_measured_and_removed(lag: float) -> None:
    estimate = track(TIME, swing(TIME - lag))
    late = score(estimate.stamps, estimate.tilt, Association(REFERENCE), 0)
    assert late.delay_s == pytest.approx(lag, abs=2e-4)
    aligned = Association(REFERENCE, ScoringOptions(reference_delay=lag))
    assert score(estimate.stamps, estimate.tilt, aligned, 0).mse_deg2 < 1e-5


def test_gap_and_ends_of_the_reference_are_left_out_and_counted() -> None:
    inside = (REFERENCE_TIME < 5.0) | (REFERENCE_TIME > 8.0)
    gappy = track(REFERENCE_TIME[inside], swing(REFERENCE_TIME[inside]))
    time = np.arange(-1.0, 22.0, 0.01)
    estimate = track(time, swing(time))
    result = score(estimate.stamps, estimate.tilt, Association(gappy), 0)
    expected = int(((time >= 0.0) & (time <= 5.0)).sum() + ((time >= 8.0) & (time < 20.0)).sum())
    assert abs(result.samples - expected) <= 2
    assert result.samples + result.left_out == time.size
    assert result.mse_deg2 < 1e-6


def test_reference_that_wraps_and_an_estimate_beyond_a_turn_agree() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    turning = 1.5 * time
    reference = track(time, (turning + np.pi) % (2 * np.pi) - np.pi)
    result = score(track(time, turning).stamps, turning, Association(reference), 0)
    assert result.max_abs_deg < 1e-6


def test_offset_is_added_to_the_reference() -> None:
    estimate = track(TIME, swing(TIME) + 0.01)
    association = Association(REFERENCE, ScoringOptions(reference_offset=0.01))
    assert score(estimate.stamps, estimate.tilt, association, 0).mse_deg2 < 1e-5


def recording(reference: TiltTrack | None) -> Recording:
    """Return a recording of a resting IMU with the given reference."""
    stamps = track(TIME, TIME).stamps
    zeros = np.zeros((stamps.size, 3))
    return Recording("somewhere", ImuTrack(stamps, zeros, zeros), reference=reference)


def test_no_overlap_names_recording_and_estimator() -> None:
    far = TiltTrack(REFERENCE.stamps + 1000 * SECOND, REFERENCE.tilt)
    estimate = track(TIME, swing(TIME))
    with pytest.raises(RecordingError, match=r"somewhere: mine: .*do not overlap"):
        score_recording(recording(far), {"mine": estimate})


def test_missing_reference_is_an_error() -> None:
    with pytest.raises(RecordingError, match="somewhere: there is no reference"):
        score_recording(recording(None), {})


def test_json_has_recordings_and_their_mean_and_skips_time() -> None:
    late_start = np.where(TIME < 3.0, 1.0, swing(TIME))
    estimates = {"good": track(TIME, swing(TIME)), "late": track(TIME, late_start)}
    first = score_recording(recording(REFERENCE), estimates, ScoringOptions(skip=3.0))
    shifted = {"good": track(TIME, swing(TIME) + math.radians(1.0))}
    second = score_recording(recording(REFERENCE), shifted, ScoringOptions(skip=3.0))
    assert first.estimators["late"].mse_deg2 < 1e-5
    document = as_json([first, second])
    assert set(document["mean"]) == {"good"}
    assert document["mean"]["good"]["mse_deg2"] == pytest.approx(0.5, rel=1e-3)
    entry = document["recordings"][0]
    assert {"source", "dt", "samples", "estimators"} <= set(entry)
    assert {"mse_deg2", "rmse_deg", "bias_deg", "max_abs_deg", "delay_s"} <= set(
        entry["estimators"]["good"]
    )
