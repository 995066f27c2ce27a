"""The checks of a live stream: same words as on a recording, once they stay."""

from __future__ import annotations

from dataclasses import replace

import pytest

from twbr_estimation.checks.check import check
from twbr_estimation.checks.finding import Finding, noteworthy
from twbr_estimation.checks.live import PERIOD, LiveChecks
from twbr_estimation.pipeline.pairing import pair
from twbr_estimation.recording import Recording
from twbr_estimation.samples import Sample
from twbr_estimation.simulation import Simulated, simulate


@pytest.fixture(scope="module")
def drive() -> Simulated:
    return simulate("W1", 0.01, 30.0, 305)


def backward(drive: Simulated) -> Recording:
    recording = replace(drive.recording, reference=None)
    assert recording.wheels is not None
    return replace(recording, wheels=replace(recording.wheels, angle=-recording.wheels.angle))


def looks(drive: Simulated, recording: Recording) -> list[tuple[Finding, ...]]:
    """Return what every look finds, one each `PERIOD` of the stream."""
    checks, found, ended = LiveChecks(drive.setup), [], 0
    samples = pair(recording.imu, recording.wheels)
    for stamp, row in zip(samples.stamps.tolist(), samples.columns.T.tolist(), strict=True):
        checks.add(stamp, Sample(*row[: len(Sample._fields)]))
        if stamp - samples.stamps[0] > (ended + 1) * PERIOD * 1e9:
            ended += 1
            checks.look(ended * PERIOD)
            checks.wait()
            found.append(checks.findings)
    return found


def test_a_good_stream_shows_nothing(drive: Simulated) -> None:
    assert all(each == () for each in looks(drive, drive.recording))


def test_what_stays_is_found_in_the_words_of_the_recording(drive: Simulated) -> None:
    found = looks(drive, backward(drive))
    assert found[:2] == [(), ()], "one look is not enough"
    (last,) = found[-1]
    found_whole = noteworthy(check(backward(drive), drive.setup))
    (whole,) = (each for each in found_whole if each.check != "saturation")
    assert last.text == whole.text and last.severity is whole.severity


def test_another_setup_is_judged_again(drive: Simulated) -> None:
    checks = LiveChecks(drive.setup)
    samples = pair(backward(drive).imu, backward(drive).wheels)
    for stamp, row in zip(samples.stamps.tolist(), samples.columns.T.tolist(), strict=True):
        checks.add(stamp, Sample(*row[: len(Sample._fields)]))
    for now in (0.0, PERIOD):
        checks.look(now)
        checks.wait()
    assert checks.findings
    checks.configure(replace(drive.setup, robot=replace(drive.setup.robot, wheel_radius=0.04)))
    assert checks.findings == ()
