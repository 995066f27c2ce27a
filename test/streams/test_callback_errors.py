"""Counting and describing errors of callbacks."""

from __future__ import annotations

from twbr_estimation.errors import MessageError
from twbr_estimation.streams.callback_errors import (
    LOG_PERIOD,
    REPORTED_FOR,
    CallbackErrors,
    described,
)


def raised() -> ZeroDivisionError:
    try:
        raise ZeroDivisionError("division\nby zero")
    except ZeroDivisionError as error:
        return error


def test_each_callback_is_logged_at_most_once_a_period() -> None:
    callback_errors = CallbackErrors()
    lines = [callback_errors.note("imu", raised(), 0.001 * n) for n in range(500)]
    assert [bool(line) for line in lines] == [True] + 499 * [False]
    assert callback_errors.note("joints", raised(), 0.5).startswith("joints: ZeroDivisionError")
    later = callback_errors.note("imu", raised(), LOG_PERIOD + 1.0)
    assert "501 errors so far" in later and callback_errors.counts == {"imu": 501, "joints": 1}


def test_the_latest_error_is_reported_for_a_while() -> None:
    callback_errors = CallbackErrors()
    assert callback_errors.recent(0.0) == ""
    callback_errors.note("imu", raised(), 5.0)
    assert "imu" in callback_errors.recent(5.0 + REPORTED_FOR)
    assert callback_errors.recent(5.1 + REPORTED_FOR) == ""


def test_a_defect_is_named_with_its_place_in_one_line() -> None:
    assert described(raised()).startswith(
        "ZeroDivisionError: division by zero (test_callback_errors.py:"
    )
    assert described(MessageError("too short")) == "too short"


def test_memory_is_bounded_whatever_the_callbacks_are_called() -> None:
    callback_errors = CallbackErrors()
    for number in range(10_000):
        callback_errors.note(f"topic{number}", raised(), 0.0)
    assert len(callback_errors.counts) <= 101 and callback_errors.counts.total() == 10_000
