"""The checks on a stream: the same findings as on the recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from twbr_estimation.checks.finding import noteworthy
from twbr_estimation.checks.recent import RecentChecks
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import Recording
from twbr_estimation.samples import Sample
from twbr_estimation.simulation import Simulated, simulate


@pytest.fixture(scope="module")
def drive() -> Simulated:
    return simulate("W4", 0.005, 30.0, 303)


def fed(checks: RecentChecks, recording: Recording) -> RecentChecks:
    samples = pair(recording.imu, recording.wheels)
    for stamp, row in zip(samples.stamps.tolist(), samples.columns.T.tolist(), strict=True):
        checks.add(stamp, Sample(*row[: len(Sample._fields)]))
    assert recording.reference is not None
    track = recording.reference
    for stamp, tilt in zip(track.stamps.tolist(), track.tilt.tolist(), strict=True):
        checks.add_reference(stamp, tilt)
    return checks


def told(checks: RecentChecks) -> set[str]:
    found = noteworthy(checks.findings())
    return {f"{each.subject} {each.check}" for each in found if each.check != "saturation"}


def test_a_good_stream_gives_no_warning(drive: Simulated) -> None:
    assert told(fed(RecentChecks(drive.setup, 20.0, 250.0), drive.recording)) == set()


def test_a_mirrored_wheel_is_found_in_a_stream(drive: Simulated) -> None:
    wheels = drive.recording.wheels
    assert wheels is not None
    mirrored = replace(wheels, angle=wheels.angle * [-1.0, 1.0])
    checks = fed(RecentChecks(drive.setup), replace(drive.recording, wheels=mirrored))
    assert told(checks) == {"wheels sign"}


def test_only_the_last_seconds_count(drive: Simulated) -> None:
    checks = fed(RecentChecks(drive.setup, 8.0), drive.recording)
    recent = checks.recording()
    assert recent is not None and recent.duration == pytest.approx(8.0, abs=0.01)
    full = fed(RecentChecks(drive.setup, 8.0, fastest=50.0), drive.recording).recording()
    assert full is not None and full.imu.stamps[-1] == drive.recording.imu.stamps[-1]
    assert np.all(np.diff(full.imu.stamps) > 0) and full.imu.stamps.size == 400


def test_a_jump_back_in_time_begins_afresh(drive: Simulated) -> None:
    checks = fed(RecentChecks(drive.setup), drive.recording)
    checks.add(5, Sample(0.0, *(0.0,) * 6))
    assert checks.recording() is None and checks.findings() == ()
