"""Playing a recording into a sink: order, timing by a steady clock, windows, stops."""

from __future__ import annotations

import struct
import threading
import time

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.streams.replay.pacing import FlowWindow, Pace
from twbr_estimation.streams.replay.player import (
    HeaderClocks,
    PlayedPart,
    Player,
    shifted,
    stamp_of,
)

SECOND = 1_000_000_000


def stamped(stamp: int) -> bytes:
    """Return the beginning of a serialised message with a header."""
    return b"\0\1\0\0" + struct.pack("<iI", *divmod(stamp, SECOND)) + b"rest"


class Tape:
    """`count` messages on two topics in turn, a millisecond apart."""

    def __init__(self, count: int, start: int = 5 * SECOND) -> None:
        self._times = [start + 1_000_000 * k for k in range(count)]

    def __len__(self) -> int:
        return len(self._times)

    def time(self, index: int) -> int:
        return self._times[index]

    def first_at(self, time: int) -> int:
        return sum(each < time for each in self._times)

    def message(self, index: int) -> tuple[str, bytes]:
        return "ab"[index % 2], stamped(self._times[index])


class Collector:
    """A sink that keeps everything, and confirms it to a window after a delay."""

    def __init__(self) -> None:
        self.stamps: list[int] = []
        self.clock: list[int] = []
        self.flushes = 0

    def publish(self, topic: str, content: bytes) -> None:
        self.stamps.append(stamp_of(content))

    def publish_clock(self, now: int) -> None:
        self.clock.append(now)

    def flush(self) -> None:
        self.flushes += 1

    def now(self) -> int:
        return 100 * SECOND


def play(player: Player, window: FlowWindow | None = None) -> None:
    player.play(("a", "b"), window)


def test_everything_comes_in_order_with_a_clock() -> None:
    tape, sink = Tape(100), Collector()
    play(Player(tape, sink, Pace(0.0)))
    assert sink.stamps == [tape.time(k) for k in range(100)]
    assert sink.clock == [tape.time(k) for k in range(0, 100, 10)]
    assert sink.flushes >= 1


def test_the_rate_sets_the_time_it_takes() -> None:
    tape, sink = Tape(100), Collector()
    begin = time.monotonic()
    play(Player(tape, sink, Pace(2.0)))
    assert time.monotonic() - begin >= 0.0495


def test_a_stretch_and_new_stamps() -> None:
    tape, sink = Tape(100), Collector()
    stretch = PlayedPart(start=0.02, duration=0.03, restamp=True)
    play(Player(tape, sink, Pace(0.0), stretch=stretch))
    assert sink.stamps == [100 * SECOND + 1_000_000 * k for k in range(30)]
    assert sink.clock == [100 * SECOND + 10_000_000 * k for k in range(3)]


@pytest.mark.parametrize(
    ("part", "said"),
    [
        (PlayedPart(start=0.2), r"start: 0.2 s is behind the end .* 0.099 s long"),
        (PlayedPart(start=0.0502, duration=0.0001), "duration: there is no message"),
    ],
)
def test_a_part_without_a_message_is_refused(part: PlayedPart, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        Player(Tape(100), Collector(), Pace(1.0), part)


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_a_loop_of_one_message_does_not_flood(rate: float) -> None:
    sink = Collector()
    player = Player(Tape(1), sink, Pace(rate))
    player.loop = True
    thread = threading.Thread(target=play, args=(player,))
    begin = time.monotonic()
    thread.start()
    time.sleep(0.25)
    player.stop()
    thread.join(5.0)
    taken = time.monotonic() - begin
    assert not thread.is_alive()
    assert 1 <= len(sink.stamps) <= taken / 0.1 + 1.0


def test_no_more_is_under_way_than_the_window_allows() -> None:
    tape, sink = Tape(400), Collector()
    window = FlowWindow(4, ["one", "two"])
    player = Player(tape, sink, Pace(0.0))
    most = 0
    thread = threading.Thread(target=play, args=(player, window))
    thread.start()
    done = 0
    while done < 400:
        sent = len(sink.stamps)
        most = max(most, sent - done)
        if sent > done:
            player.report("one", sink.stamps[-1])
            player.report("two", sink.stamps[done])
            done += 1
    thread.join(timeout=5.0)
    assert not thread.is_alive() and player.stalls == 0
    assert len(sink.stamps) == 400
    assert most <= 9  # four of each topic, and one that was let through meanwhile


def test_a_consumer_that_stops_is_not_waited_for_forever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("twbr_estimation.streams.replay.player.STALL_LIMIT", 0.01)
    monkeypatch.setattr("twbr_estimation.streams.replay.player.DRAIN_LIMIT", 0.01)
    sink = Collector()
    player = Player(Tape(20), sink, Pace(0.0))
    play(player, FlowWindow(5, ["dead"]))
    assert len(sink.stamps) == 20 and player.stalls == 1


@pytest.mark.parametrize("window", [None, FlowWindow(1, ["dead"])])
def test_stop_ends_it_at_once(window: FlowWindow | None) -> None:
    player = Player(Tape(1000), Collector(), Pace(0.001 if window is None else 0.0))
    thread = threading.Thread(target=play, args=(player, window))
    thread.start()
    player.stop()
    thread.join(timeout=1.0)
    assert not thread.is_alive()


def test_pace_keeps_its_place_through_pauses_and_changes_of_speed() -> None:
    pace = Pace(2.0)
    pace.start_at(10 * SECOND, now=100.0)
    assert pace.recorded_at(101.0) == 12 * SECOND
    pace.pause(101.0)
    assert pace.delay(12 * SECOND, 105.0) == float("inf")
    pace.resume(105.0)
    assert pace.delay(14 * SECOND, 105.0) == pytest.approx(1.0)
    pace.set_rate(0.5, 105.5)
    assert pace.recorded_at(105.5) == 13 * SECOND
    assert pace.delay(14 * SECOND, 105.5) == pytest.approx(2.0)


@pytest.mark.parametrize("shift", [0, 1, -3 * SECOND, 7 * SECOND + 5])
@pytest.mark.parametrize("order", ["<", ">"])
def test_stamps_shift_and_all_else_stays(shift: int, order: str) -> None:
    head = b"\0\1\0\0" if order == "<" else b"\0\0\0\0"
    content = head + struct.pack(f"{order}iI", 9, 999_999_999) + b"rest"
    stamp, moved = shifted(content, shift)
    assert stamp == stamp_of(moved) == 9 * SECOND + 999_999_999 + shift
    assert moved[:4] == head and moved[12:] == b"rest"


class DeviceTape(Tape):
    """Topic `a` is stamped by a device that was switched on 3 s before, `b` by the recorder."""

    def message(self, index: int) -> tuple[str, bytes]:
        topic = "ab"[index % 2]
        return topic, stamped(self._times[index] - (self._times[0] - 3 * SECOND) * (topic == "a"))


def test_stamps_of_another_clock_begin_now_too() -> None:
    tape, sink = DeviceTape(50, start=10**9 * SECOND), Collector()
    player = Player(tape, sink, Pace(0.0), PlayedPart(restamp=True))
    play(player)
    assert sink.stamps == [100 * SECOND + 1_000_000 * index for index in range(50)]
    assert sink.clock[0] == 100 * SECOND
    assert player.other_clocks == {"a": pytest.approx(3.0 - 1e9)}


def test_without_restamp_stamps_of_another_clock_stay_and_are_named() -> None:
    tape, sink = DeviceTape(50, start=10**9 * SECOND), Collector()
    player = Player(tape, sink, Pace(0.0))
    play(player)
    assert sink.stamps[:2] == [3 * SECOND, tape.time(1)]
    assert list(player.other_clocks) == ["a"]


def test_topics_of_one_other_clock_keep_their_distance() -> None:
    clocks = HeaderClocks(7 * SECOND, restamp=True)
    first = clocks.shift("imu", 3 * SECOND, 1000 * SECOND)
    assert 3 * SECOND + first == 1007 * SECOND
    assert clocks.shift("joints", 4 * SECOND, 1002 * SECOND) == first
    assert clocks.shift("other", 500 * SECOND, 1002 * SECOND) == 509 * SECOND


def test_a_stamp_stays_within_a_header() -> None:
    for stamp, shift in ((5, -10 * SECOND), ((2**31 - 1) * SECOND, 10 * SECOND)):
        moved, content = shifted(stamped(stamp), shift)
        assert moved == stamp_of(content) and 0 <= moved < 2**31 * SECOND


def test_a_message_too_short_for_a_header_is_passed_on() -> None:
    class Short(Tape):
        def message(self, index: int) -> tuple[str, bytes]:
            return "a", b"\0\1\0\0" + bytes(12) if index else b"\0\1\0\0"

    received: list[bytes] = []
    sink = Collector()
    sink.publish = lambda topic, content: received.append(content)  # type: ignore[method-assign]
    play(Player(Short(2), sink, Pace(0.0)))
    assert list(map(len, received)) == [4, 16]
