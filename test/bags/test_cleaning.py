"""Stamps that repeat, jump or go back have one defined outcome each."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twbr_estimation.bags.cdr import Columns
from twbr_estimation.bags.cleaning import Cleaner
from twbr_estimation.errors import RecordingError

MS = 1_000_000
SECOND = 1000 * MS


def clean(stamps: list[int], bag_times: list[int] | None = None) -> tuple[list[int], Counter[str]]:
    """Return which messages remain, in order, and the repairs."""
    repairs: Counter[str] = Counter()
    times = np.array(bag_times or range(len(stamps)), dtype=np.int64)
    values = np.arange(len(stamps), dtype=np.float64)[:, None]
    frames = np.full(len(stamps), "f", dtype=object)
    columns = Columns(np.array(stamps, dtype=np.int64), times, values, frames)
    cleaned = Cleaner("/topic", repairs).clean(columns, slice(None))
    assert np.all(np.diff(cleaned.stamps) > 0)
    return cleaned.values[:, 0].astype(int).tolist(), repairs


def steady(count: int, start: int = 10 * SECOND) -> list[int]:
    return [start + 10 * MS * index for index in range(count)]


def test_good_stamps_pass_unchanged() -> None:
    assert clean(steady(10)) == (list(range(10)), Counter())


def test_of_repeated_stamps_the_first_message_stays() -> None:
    stamps = steady(6)
    stamps[3] = stamps[2]
    kept, repairs = clean(stamps)
    assert kept == [0, 1, 2, 4, 5]
    assert repairs == {"/topic: messages with a repeated stamp dropped": 1}


def test_a_late_message_is_sorted_in() -> None:
    stamps = steady(6)
    stamps[2], stamps[3] = stamps[3], stamps[2]
    kept, repairs = clean(stamps)
    assert kept == [0, 1, 3, 2, 4, 5]
    assert repairs == {"/topic: late messages sorted in": 1}


def test_the_order_of_recording_rules_over_the_order_in_the_file() -> None:
    stamps = steady(4)
    kept, repairs = clean(stamps[::-1], [3, 2, 1, 0])
    assert kept == [3, 2, 1, 0]
    assert repairs == Counter()


def test_of_a_looped_bag_the_longest_pass_stays() -> None:
    passes = steady(150), steady(200), steady(120)
    kept, repairs = clean([stamp for stamps in passes for stamp in stamps])
    assert kept == list(range(150, 350))
    assert repairs["/topic: backward jumps of the stamps by more than 1 s"] == 2
    assert repairs["/topic: messages outside the longest pass dropped"] == 270


def test_a_clock_that_was_set_back_leaves_the_longer_part() -> None:
    kept, _ = clean([*steady(5, 100 * SECOND), *steady(20, 50 * SECOND)])
    assert kept == list(range(5, 25))


def test_a_stray_stamp_costs_one_message() -> None:
    stamps = steady(10)
    stamps[4] = 10**18
    kept, repairs = clean(stamps)
    assert kept == [0, 1, 2, 3, 5, 6, 7, 8, 9]
    assert repairs == {"/topic: messages with a stray stamp dropped": 1}


def test_stamps_of_zero_are_dropped() -> None:
    stamps = steady(6)
    stamps[0] = stamps[3] = 0
    assert clean(stamps)[0] == [1, 2, 4, 5]


def test_a_simulation_may_start_at_zero() -> None:
    assert clean(steady(5, start=0)) == (list(range(5)), Counter())


def test_a_driver_that_never_stamps_is_an_error() -> None:
    with pytest.raises(RecordingError, match="stamps of all 4 messages are 0"):
        clean([0, 0, 0, 0])


def test_gaps_are_counted_and_left() -> None:
    stamps = [*steady(20), *steady(20, 15 * SECOND)]
    kept, repairs = clean(stamps)
    assert kept == list(range(40))
    assert repairs == {"/topic: gaps longer than 0.05 s left as they are": 1}


@given(st.lists(st.integers(0, 5 * SECOND), min_size=1, max_size=40))
def test_every_message_is_kept_or_counted(stamps: list[int]) -> None:
    try:
        kept, repairs = clean(stamps)
    except RecordingError:
        assert set(stamps) == {0}
        return
    dropped = sum(count for what, count in repairs.items() if what.endswith("dropped"))
    assert len(kept) + dropped == len(stamps)
    assert len(set(kept)) == len(kept)
