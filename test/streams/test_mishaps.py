"""Counting and describing errors of callbacks."""

from __future__ import annotations

from twbr_estimation.errors import MessageError
from twbr_estimation.streams.mishaps import LOG_PERIOD, REPORTED_FOR, Mishaps, described


def raised() -> ZeroDivisionError:
    try:
        raise ZeroDivisionError("division\nby zero")
    except ZeroDivisionError as error:
        return error


def test_each_callback_is_logged_at_most_once_a_period() -> None:
    mishaps = Mishaps()
    lines = [mishaps.note("imu", raised(), 0.001 * n) for n in range(500)]
    assert [bool(line) for line in lines] == [True] + 499 * [False]
    assert mishaps.note("joints", raised(), 0.5).startswith("joints: ZeroDivisionError")
    later = mishaps.note("imu", raised(), LOG_PERIOD + 1.0)
    assert "501 errors so far" in later and mishaps.counts == {"imu": 501, "joints": 1}


def test_the_latest_error_is_reported_for_a_while() -> None:
    mishaps = Mishaps()
    assert mishaps.recent(0.0) == ""
    mishaps.note("imu", raised(), 5.0)
    assert "imu" in mishaps.recent(5.0 + REPORTED_FOR)
    assert mishaps.recent(5.1 + REPORTED_FOR) == ""


def test_a_defect_is_named_with_its_place_in_one_line() -> None:
    assert described(raised()).startswith("ZeroDivisionError: division by zero (test_mishaps.py:")
    assert described(MessageError("too short")) == "too short"


def test_memory_is_bounded_whatever_the_callbacks_are_called() -> None:
    mishaps = Mishaps()
    for number in range(10_000):
        mishaps.note(f"topic{number}", raised(), 0.0)
    assert len(mishaps.counts) <= 101 and mishaps.counts.total() == 10_000
