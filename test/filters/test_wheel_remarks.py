"""What a user reads about wheels that the filter ignores: live, in a table and in a report."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from twbr_estimation.drives import Drive
from twbr_estimation.filters.inertial.wheel_check import begin_check
from twbr_estimation.filters.inertial.wheel_remarks import wheel_remarks
from twbr_estimation.recording import TiltTrack
from twbr_estimation.samples import CorrectedSample
from twbr_estimation.simulation import simulate
from twbr_estimation.simulation.hard_days import DAYS
from twbr_estimation.streams.filter_configuration import FilterConfiguration, FilterSettings
from twbr_estimation.streams.filtering import FilterStream

SEED = 4003
DT = 0.005


def drive(day: str) -> Drive:
    made = DAYS[day](SEED, DT)
    assert made.recording.truth is not None
    truth = TiltTrack(made.recording.truth.stamps, made.recording.truth.tilt)
    return Drive(made.recording, made.setup).with_reference(truth)


def remarks(made: Drive) -> Iterator[tuple[float, tuple[str, ...], float]]:
    """Yield time [s], remarks and how long wheels were ignored [s] at each sample, live."""
    settings = FilterSettings(filter="ins_odometer")
    stream = FilterStream(FilterConfiguration(settings, robot=made.setup.robot))
    time = 0.0
    for column in made.corrected.columns.T.tolist():
        stream.step(CorrectedSample(*column))
        time += DT
        yield time, stream.remarks(), stream.wheels_ignored()


@pytest.mark.parametrize(
    ("day", "cause"),
    [
        ("encoder signs wrong", "turn against its motion"),
        ("degrees for radians", "report about [5-9]0 times its motion"),
        ("counts halved", r"report about 0\.[3-6] times its motion"),
    ],
)
def test_a_live_stream_says_why_wheels_are_ignored(day: str, cause: str) -> None:
    _, (sentence,), ignored = next(each for each in remarks(drive(day)) if each[0] > 15.0)
    stated = re.match(r"the wheels contradict the IMU since (\d+\.\d) s: ", sentence)
    assert stated is not None
    assert re.search(cause, sentence)
    assert ignored == pytest.approx(float(stated[1]), abs=0.06)
    assert ignored > 5.0


def test_figures_of_a_recording_say_for_how_long_wheels_were_ignored() -> None:
    runs = drive("encoder signs wrong").run("ins_odometer", "complementary")
    score = runs.scores()
    assert set(score.wheels_ignored_s) == {"ins_odometer"}
    ignored = score.wheels_ignored_s["ins_odometer"]
    assert ignored > 0.8 * runs.recording.duration
    (warning,) = [text for text in score.warnings if text.startswith("ins_odometer: the wheels")]
    assert warning.endswith(f"wheels ignored for {ignored:.1f} s of the recording")


def test_wheels_that_are_used_again_are_still_in_the_figures() -> None:
    runs = drive("carried, wheels run").run("ins_odometer")
    assert runs.wheels_ignored["ins_odometer"] > 10.0
    assert any("wheels ignored for" in text for text in runs.warnings)


def test_good_wheels_leave_no_remark() -> None:
    runs = simulate("W4", DT, 30.0, SEED).drive.run("ins_odometer")
    assert runs.wheels_ignored == {"ins_odometer": 0.0}
    assert not any("wheels" in text for text in runs.warnings)
    assert wheel_remarks(begin_check()) == ()


def test_short_slips_are_named_and_do_not_make_the_wheels_ignored() -> None:
    simulated = simulate("W2", DT, 30.0, SEED)
    assert simulated.world.slips_per_second > 0.0
    runs = simulated.drive.run("ins_odometer")
    assert runs.wheels_ignored == {"ins_odometer": 0.0}
    (said,) = [text for text in runs.warnings if "wheels" in text]
    assert said.startswith("wheels: they turn otherwise than the IMU moves at ")
