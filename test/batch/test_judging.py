"""The share of a recording's estimates that deserves trust."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from twbr_estimation.batch import CorrectedTrack, EstimateTrack, correct, run_filter
from twbr_estimation.batch.judging import trusted, trusted_share
from twbr_estimation.drives import Drive
from twbr_estimation.filters import filter_named
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.samples import TiltEstimate
from twbr_estimation.simulation import simulate


def test_bursts_of_lost_samples_lower_the_share_that_is_trusted() -> None:
    made = simulate("W2", 0.005, 12.0, 3)
    imu = made.recording.imu
    time = (imu.stamps - imu.stamps[0]) * 1e-9
    keep = (time < 2.0) | (time > 8.0) | (time % 1.6 > 0.5)
    bursts = replace(imu, stamps=imu.stamps[keep], gyro=imu.gyro[keep], accel=imu.accel[keep])
    whole = Drive(made.recording, made.setup).run("complementary", "kalman")
    holed = Drive(replace(made.recording, imu=bursts), made.setup).run("complementary", "kalman")
    for name in ("complementary", "kalman"):
        assert whole.trusted[name] > holed.trusted[name] + 0.1
    assert np.isfinite(list(holed.trusted.values())).all()


ENTRY = filter_named("ins_odometer")


@cache
def drive() -> tuple[CorrectedTrack, EstimateTrack]:
    made = simulate("W1", 0.02, 10.0, 5)
    corrected = correct(pair(made.recording.imu, made.recording.wheels), made.setup)
    return corrected, run_filter(ENTRY, ENTRY.configure(), corrected, made.setup.robot)


def test_the_share_is_that_of_the_valid_estimates() -> None:
    corrected, found = drive()
    valid = trusted(ENTRY, corrected, found)
    assert valid.shape == corrected.stamps.shape
    assert 0.5 < np.mean(valid) == trusted_share(ENTRY, corrected, found)


def test_an_estimate_with_a_large_variance_is_not_valid() -> None:
    corrected, found = drive()
    columns = found.columns.copy()
    columns[TiltEstimate._fields.index("tilt_variance"), 300:310] = 0.3**2
    valid = trusted(ENTRY, corrected, EstimateTrack(found.stamps, columns, found.state))
    assert valid[299]
    assert not valid[300:310].any()
    assert valid[310]
