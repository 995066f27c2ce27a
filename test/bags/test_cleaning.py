"""Stamps that repeat, jump or go back have one defined outcome each."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twbr_estimation.bags.cleaning import Cleaner
from twbr_estimation.bags.decoding import Columns
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


def test_a_burst_that_came_late_is_sorted_in() -> None:
    stamps = steady(60)
    burst, rest = stamps[20:35], stamps[:20] + stamps[35:50]
    kept, repairs = clean(rest + burst + stamps[50:])
    assert len(kept) == 60
    assert repairs == {"/topic: late messages sorted in": 15}


@pytest.mark.parametrize("step", [500 * MS, 503 * MS, 80 * MS])
def test_a_clock_set_back_by_less_than_a_second_begins_a_new_pass(step: int) -> None:
    stamps = [*steady(200), *steady(100, start=10 * SECOND + 2000 * MS - step)]
    kept, repairs = clean(stamps)
    assert kept == list(range(200))
    assert repairs == {
        "/topic: backward jumps of the stamps": 1,
        "/topic: messages outside the longest pass dropped": 100,
    }


def test_messages_recorded_twice_count_once() -> None:
    repairs: Counter[str] = Counter()
    stamps = np.array([*steady(50), *steady(50)[30:], *steady(30, 11 * SECOND)], dtype=np.int64)
    order, frames = np.arange(100), np.full(100, "f", dtype=object)
    columns = Columns(stamps, order, (stamps % 77)[:, None].astype(float), frames)
    cleaned = Cleaner("/topic", repairs).clean(columns, slice(None))
    assert cleaned.stamps.size == 80
    assert repairs["/topic: messages with a repeated stamp dropped"] == 20


def test_numbers_beyond_all_physics_are_dropped() -> None:
    repairs: Counter[str] = Counter()
    values = np.array([[1.0], [-1e300], [2.0], [1e9]])
    stamps = np.array(steady(4), dtype=np.int64)
    columns = Columns(stamps, stamps, values, np.full(4, "f", dtype=object))
    assert Cleaner("/topic", repairs).clean(columns, slice(None)).values.tolist() == [[1.0], [2.0]]
    assert repairs["/topic: messages with a number beyond 1e+09 dropped"] == 2


def test_the_order_of_recording_rules_over_the_order_in_the_file() -> None:
    stamps = steady(4)
    kept, repairs = clean(stamps[::-1], [3, 2, 1, 0])
    assert kept == [3, 2, 1, 0]
    assert repairs == Counter()


def test_of_a_looped_bag_the_longest_pass_stays() -> None:
    passes = steady(150), steady(200), steady(120)
    kept, repairs = clean([stamp for stamps in passes for stamp in stamps])
    assert kept == list(range(150, 350))
    assert repairs["/topic: backward jumps of the stamps"] == 2
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
        assert len(set(stamps)) == 1
        return
    dropped = sum(count for what, count in repairs.items() if what.endswith("dropped"))
    assert len(kept) + dropped == len(stamps)
    assert len(set(kept)) == len(kept)


@pytest.mark.parametrize("offset", [50 * SECOND, -9 * SECOND])
def test_of_two_senders_with_clocks_of_their_own_one_is_kept(offset: int) -> None:
    """The one with more messages, of equally many the one nearest to the recorder's clock."""
    times = steady(60)
    stamps = [time if index % 2 else time + offset for index, time in enumerate(times)]
    kept, repairs = clean(stamps, times)
    assert kept == list(range(1, 60, 2))
    what = "messages of another sender, with a clock of its own, dropped"
    assert repairs == {f"/topic: {what}": 30}
    stamps = [time + offset if index % 3 else time for index, time in enumerate(times)]
    assert clean(stamps, times)[0] == [index for index in range(60) if index % 3]


def test_stamps_that_are_all_the_same_are_refused() -> None:
    with pytest.raises(RecordingError, match=r"all 4 messages are equal; .*arrival"):
        clean([7 * SECOND] * 4)


def coarse(values: np.ndarray, tick: int, period: int = 5 * MS) -> tuple[Columns, Counter[str]]:
    """Return what is left of readings that came every `period` on a clock of so coarse a tick."""
    repairs: Counter[str] = Counter()
    times = 10 * SECOND + period * np.arange(len(values), dtype=np.int64)
    columns = Columns(times // tick * tick, times, values, np.full(len(values), "f", dtype=object))
    return Cleaner("/topic", repairs).clean(columns, slice(None)), repairs


@pytest.mark.parametrize("tick", [10 * MS, 20 * MS, 15_625_000])
def test_readings_within_a_tick_of_a_coarse_clock_are_kept(tick: int) -> None:
    values = np.random.default_rng(1).standard_normal((400, 3))
    kept, repairs = coarse(values, tick)
    assert np.array_equal(kept.values, values)
    assert np.abs(kept.stamps - (10 * SECOND + 5 * MS * np.arange(400))).max() < tick
    assert np.all(np.diff(kept.stamps) > 0)
    (name,) = repairs
    assert f"spread evenly within a tick of their clock, {tick / MS:.3g} ms" in name


def test_a_smooth_motion_on_a_coarse_clock_has_the_stamps_it_was_read_at() -> None:
    values = np.sin(0.02 * np.arange(400.0))[:, None]
    kept, _ = coarse(values, 10 * MS)
    assert np.array_equal(kept.stamps, 10 * SECOND + 5 * MS * np.arange(400))


@pytest.mark.parametrize("apart", [0.0, 0.5])
def test_messages_sent_twice_or_by_two_senders_are_not_spread(apart: float) -> None:
    values = np.repeat(np.sin(0.02 * np.arange(200.0)), 2)[:, None]
    values[1::2] += apart
    kept, repairs = coarse(values, 10 * MS)
    assert kept.values[:, 0].tolist() == values[::2, 0].tolist()
    assert repairs == {"/topic: messages with a repeated stamp dropped": 200}
