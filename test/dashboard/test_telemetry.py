"""What the page gets of a robot between two pictures."""

from __future__ import annotations

import json
import math

import pytest

from twbr_estimation.dashboard.telemetry import ACTIVE, HISTORY, REFERENCE, Telemetry

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def swing(telemetry: Telemetry, seconds: float, lag: float = 0.0, bias: float = 0.0) -> None:
    """Add a swing of 0.2 rad at 1 Hz, and an estimate of it that lags [s] and is off [rad]."""
    for i in range(int(200 * seconds)):
        if i % 200 == 199:
            telemetry.frame()  # pictures are taken all the time
        time = i * 0.005
        stamp = START + round(time * SECOND)
        telemetry.add_reference(stamp, 0.2 * math.sin(2 * math.pi * time))
        estimate = 0.2 * math.sin(2 * math.pi * (time - lag)) + bias
        telemetry.add_estimate(ACTIVE, stamp, estimate, 0.01**2)


def test_figures_are_those_of_the_errors_that_were_made() -> None:
    telemetry = Telemetry()
    swing(telemetry, 10.0, lag=0.004, bias=math.radians(0.5))
    telemetry.frame()
    row = telemetry.sums[ACTIVE].row(ACTIVE)
    assert row["bias"] == pytest.approx(0.5, abs=0.01)
    assert row["delay"] == pytest.approx(4.0, abs=0.1)
    lag_error = math.degrees(0.2) * 2 * math.pi * 0.004 / math.sqrt(2.0)
    assert row["mse"] == pytest.approx(0.25 + lag_error**2, rel=0.02)


def test_a_frame_holds_what_came_since_the_last_one() -> None:
    telemetry = Telemetry()
    swing(telemetry, 0.5)
    first = telemetry.frame()
    assert len(first["traces"][ACTIVE]) == len(first["traces"][REFERENCE]) == 100
    assert first["errors"][0] == [0.0, 0.0, pytest.approx(math.degrees(0.01), abs=1e-4)]
    assert telemetry.frame()["traces"] == {}


def test_an_estimate_waits_for_the_reference_and_needs_a_near_one() -> None:
    telemetry = Telemetry()
    telemetry.add_reference(START, 0.0)
    telemetry.add_estimate(ACTIVE, START + SECOND // 20, 0.1)
    assert telemetry.frame()["errors"] == []
    telemetry.add_reference(START + SECOND // 10, 0.2)
    assert telemetry.frame()["errors"] == [[0.05, pytest.approx(0.0, abs=1e-3), 0.0]]
    telemetry.add_estimate(ACTIVE, START + SECOND, 0.1)
    telemetry.add_reference(START + 2 * SECOND, 0.2)
    assert telemetry.frame()["errors"] == [], "nothing is interpolated over a long gap"


def test_errors_are_taken_around_the_circle() -> None:
    telemetry = Telemetry()
    for i in range(3):
        telemetry.add_reference(START + i * SECOND // 100, math.radians(179.0))
        telemetry.add_estimate(ACTIVE, START + i * SECOND // 100, math.radians(-179.0))
    assert [error for _, error, _ in telemetry.frame()["errors"]] == pytest.approx([2.0] * 3)


def test_a_new_browser_gets_the_last_half_minute() -> None:
    telemetry = Telemetry()
    for i in range(int(2 * HISTORY * 10)):
        telemetry.add_estimate(ACTIVE, START + i * SECOND // 10, 0.0)
        telemetry.frame()
    history = telemetry.history()
    times = [time for time, _ in history["traces"][ACTIVE]]
    assert history["reset"]
    assert times[-1] - times[0] == pytest.approx(HISTORY, abs=0.2)


def test_numbers_that_are_not_finite_do_not_reach_the_browser() -> None:
    telemetry = Telemetry()
    telemetry.pose.roll = math.inf
    pose = telemetry.frame()["pose"]
    assert pose["tilt"] is None
    assert pose["roll"] is None


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_samples_that_are_not_finite_are_dropped_and_the_page_goes_on(wrong: float) -> None:
    telemetry = Telemetry()
    telemetry.add_reference(START, wrong)
    telemetry.add_estimate(ACTIVE, START, wrong, 1.0)
    telemetry.add_estimate(ACTIVE, START + 1, 0.1, wrong)
    telemetry.add_angle("raw", START, wrong)
    frame = telemetry.frame()
    json.dumps(frame, allow_nan=False)
    assert frame["traces"] == {ACTIVE: [[0.0, pytest.approx(math.degrees(0.1), abs=1e-4)]]}
    assert telemetry.not_finite == 3
    swing(telemetry, 1.0)
    telemetry.frame()
    assert telemetry.sums[ACTIVE].samples > 100
    json.dumps(telemetry.history(), allow_nan=False)


def test_a_clock_that_goes_back_clears_the_traces() -> None:
    telemetry = Telemetry()
    for i in range(100):
        telemetry.add_estimate(ACTIVE, START + i * SECOND, 0.0)
        telemetry.frame()
    telemetry.add_estimate(ACTIVE, START, 0.2)
    telemetry.add_estimate("other", START + 100 * SECOND, 0.2)
    frame = telemetry.frame()
    assert frame["reset"] and len(frame["traces"][ACTIVE]) == 1
    assert len(telemetry.history()["traces"][ACTIVE]) == 1


def test_topics_of_two_clocks_do_not_disturb_each_other() -> None:
    telemetry = Telemetry()
    for i in range(10):
        telemetry.add_estimate(ACTIVE, START + i * SECOND, 0.0)
        telemetry.add_reference(START - 50 * SECOND + i * SECOND, 0.0)
        assert "reset" not in telemetry.frame()
