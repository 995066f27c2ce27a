"""Lines and frames of a microcontroller, with what a serial port does to them."""

from __future__ import annotations

import itertools
import math
import random
from pathlib import Path

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.imports.csv_description import read_description
from twbr_estimation.streams.device.binary_frames import (
    TICK,
    WRAP,
    DeviceSample,
    FrameError,
    decode_frame,
    encode_frame,
)
from twbr_estimation.streams.device.clock import DeviceClock
from twbr_estimation.streams.device.lines import NANOSECOND, LineDecoder
from twbr_estimation.streams.device.port import LONGEST, PortStream, text_decoder

pytest.importorskip("cobs", reason="needs the extra serial")

COLUMNS = """
columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az], wheels: [l, r]}
units: {time: us, gyro: deg/s, accel: g, wheels: counts}
counts_per_turn: {wheels: 1000}
signs: {wheels: [1, -1]}
axes: [y, -x, z]
wheel_wrap: 65536
time_wrap: 4294967296
"""
HEADER = "t,gx,gy,gz,ax,ay,az,l,r"


def sample(number: int) -> DeviceSample:
    value = 0.001 * (number % 1000)
    return DeviceSample(number * 1000, (value, -value, 1.0), (0.5, 0.0, 9.75), (value, -value))


def lines_of(tmp_path: Path, text: str = COLUMNS) -> LineDecoder:
    path = tmp_path / "columns.yaml"
    path.write_text(text)
    return LineDecoder(read_description(path))


def test_a_frame_is_read_back() -> None:
    data = encode_frame(sample(7))
    assert len(data) == 41 and data.endswith(b"\0") and b"\0" not in data[:-1]
    found = decode_frame(data[:-1])
    assert found.ticks == 7000
    assert found.gyro == pytest.approx((0.007, -0.007, 1.0))
    assert found.accel == (0.5, 0.0, 9.75)
    assert found.wheels == pytest.approx((0.007, -0.007))
    assert decode_frame(encode_frame(sample(7)._replace(wheels=()))[:-1]).wheels == ()


@pytest.mark.parametrize("index", range(40))
def test_no_disturbed_byte_of_a_frame_passes(index: int) -> None:
    data = bytearray(encode_frame(sample(7))[:-1])
    for mask in (0x01, 0x80, 0xFF):
        disturbed = bytes([*data[:index], data[index] ^ mask, *data[index + 1 :]])
        if b"\0" in disturbed:
            continue  # ends the frame early: two cut ones
        with pytest.raises(FrameError):
            decode_frame(disturbed)


def test_a_reading_that_is_not_finite_is_refused() -> None:
    with pytest.raises(FrameError, match="not finite"):
        decode_frame(encode_frame(sample(7)._replace(gyro=(math.nan, 0.0, 0.0)))[:-1])


def test_a_line_becomes_si_units_in_body_axes(tmp_path: Path) -> None:
    decoder = lines_of(tmp_path)
    assert decoder.decode(HEADER) is None
    found = decoder.decode("2000, 180, 90, 45, 0.1, 0.2, 1, 250, 500")
    assert found is not None
    assert found.ticks == 2_000_000
    assert found.gyro == pytest.approx((math.pi / 2, -math.pi, math.pi / 4))
    assert found.accel == pytest.approx((0.2 * 9.80665, -0.1 * 9.80665, 9.80665))
    assert found.wheels == pytest.approx((math.pi / 2, -math.pi))
    assert decoder.ticks_of_wrap == 2**32 * 1000


def test_counters_go_on_where_they_start_again(tmp_path: Path) -> None:
    decoder = lines_of(tmp_path)
    decoder.decode(HEADER)
    turns = []
    for count in range(65_000, 66_500, 100):
        found = decoder.decode(f"0,0,0,0,0,0,1,{count % 65536},{-count % 65536}")
        assert found is not None
        turns.append(found.wheels)
    steps = [b[0] - a[0] for a, b in itertools.pairwise(turns)]
    assert steps == pytest.approx([0.2 * math.pi] * len(steps))
    right = [b[1] - a[1] for a, b in itertools.pairwise(turns)]
    assert right == pytest.approx([0.2 * math.pi] * len(right))


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("1,2,3", "3 fields"),
        ("1,2,3,4,5,6,7,8,x", "column r"),
        ("1,nan,3,4,5,6,7,8,9", "column gx of a line is not finite"),
        ("1,2,3,4,5,6,7,8,9,10", "10 fields"),
    ],
)
def test_a_bad_line_is_named(tmp_path: Path, line: str, reason: str) -> None:
    decoder = lines_of(tmp_path)
    decoder.decode(HEADER)
    with pytest.raises(FrameError, match=reason):
        decoder.decode(line)


def test_names_wait_for_their_header(tmp_path: Path) -> None:
    decoder = lines_of(tmp_path)
    with pytest.raises(FrameError, match=r"no header has come that names 't', 'gx'"):
        decoder.decode("1,2,3,4,5,6,7,8,9")


def test_numbered_columns_need_no_header(tmp_path: Path) -> None:
    decoder = lines_of(
        tmp_path, "columns: {time: 0, gyro: [1, 2, 3], accel: [4, 5, 6]}\nheader: false\n"
    )
    found = decoder.decode("1.5;1;2;3;4;5;6")
    assert found == DeviceSample(1_500_000_000, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), ())


def test_a_rate_instead_of_time_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="rate"):
        lines_of(tmp_path, "columns: {gyro: [1, 2, 3], accel: [4, 5, 6]}\nrate: 100\n")


def test_noise_and_cuts_cost_frames_and_are_counted() -> None:
    """1 kHz for 20 s, one byte of 500 disturbed, in pieces of any length."""
    draw, wire, sent = random.Random(3), bytearray(), 20_000
    for number in range(sent):
        wire += encode_frame(sample(number))
    for index in range(0, len(wire), 500):
        wire[index + draw.randrange(min(500, len(wire) - index))] ^= draw.randrange(1, 256)
    stream = PortStream(decode_frame, b"\0", DeviceClock(TICK, WRAP))
    at, found, last = 0, [], 0
    while at < len(wire):
        piece = wire[at : at + draw.randrange(1, 400)]
        at += len(piece)
        arrival = 1_700_000_000_000_000_000 + at * 1_000_000 // 41
        for stamp, each in stream.add(bytes(piece), arrival):
            assert stamp > last
            last = stamp
            assert each.ticks is not None
            assert each.gyro == pytest.approx(sample(each.ticks // 1000).gyro)
            found.append(each.ticks // 1000)
    assert found == sorted(set(found)), "no frame twice, none out of order"
    lost = sent - len(found)
    assert stream.counts["samples"] == len(found)
    assert 0.5 * len(wire) / 500 < lost < 2.5 * len(wire) / 500
    assert stream.counts["unreadable"] >= 0.5 * lost
    assert stream.restarts == 0


def test_a_wrong_baud_rate_is_said_and_memory_stays() -> None:
    stream = PortStream(decode_frame, b"\0", None)
    for _ in range(10):
        assert not list(stream.add(b"\xff" * LONGEST, 1))
    assert stream.counts["dropped_bytes"] >= 9 * LONGEST
    assert "baud rate" in stream.problem


def test_text_that_is_none_is_refused(tmp_path: Path) -> None:
    stream = PortStream(text_decoder(lines_of(tmp_path).decode), b"\n", None)
    assert not list(stream.add(b"cut\n\xff\xfe\n", 1))
    assert stream.counts["unreadable"] == 1, "the first part may be the end of a line"
    assert "no text" in stream.problem


def test_arrival_stamps_rise_within_a_burst(tmp_path: Path) -> None:
    decoder = lines_of(tmp_path)
    stream = PortStream(text_decoder(decoder.decode), b"\n", None)
    text = f"{HEADER}\n" + "1,2,3,4,5,6,7,8,9\n" * 5
    stamps = [stamp for stamp, _ in stream.add(text.encode(), 1000)]
    assert stamps == [1000, 1001, 1002, 1003, 1004]


def test_time_of_lines_is_related_to_ours(tmp_path: Path) -> None:
    decoder = lines_of(tmp_path)
    clock = DeviceClock(NANOSECOND, decoder.ticks_of_wrap)
    stream = PortStream(text_decoder(decoder.decode), b"\n", clock)
    stamps = []
    for i in range(3000):  # the counter of microseconds starts again on the way
        ticks = (4_294_967_296 - 1_000_000 + 2000 * i) % 4_294_967_296
        head = f"{HEADER}\n" if i == 0 else ""
        text = f"{head}{ticks},0,0,0,0,0,1,0,0\n"
        stamps += [stamp for stamp, _ in stream.add(text.encode(), 10**18 + 2_000_000 * i)]
    steps = {b - a for a, b in itertools.pairwise(stamps)}
    assert max(abs(step - 2_000_000) for step in steps) < 1000
    assert stream.restarts == 0


def test_speeds_of_the_wheels_are_integrated(tmp_path: Path) -> None:
    """By the board's time, across the restart of its counter; standing across a gap of 1 s."""
    text = (
        "columns: {time: t, gyro: [gx, gy, gz], accel: [ax, ay, az], wheel_speeds: [l, r]}\n"
        "units: {time: us, wheel_speeds: rpm}\ntime_wrap: 4294967296\n"
    )
    decoder = lines_of(tmp_path, text)
    decoder.decode(HEADER)
    angles = []
    for time in (2**32 - 20_000, 2**32 - 10_000, 0, 10_000, 3_010_000):
        found = decoder.decode(f"{time % 2**32},0,0,0,0,0,9.8,60,-30")
        assert found is not None
        angles.append(found.wheels)
    turned = [0.0, 0.01, 0.02, 0.03, 0.03]
    assert [left for left, _ in angles] == pytest.approx([2 * math.pi * t for t in turned])
    assert [right for _, right in angles] == pytest.approx([-math.pi * t for t in turned])
    without_time = text.replace("time: t, ", "").replace("time: us, ", "") + "rate: 0\n"
    with pytest.raises(ConfigurationError):
        lines_of(tmp_path, without_time)


@pytest.mark.parametrize(
    "lines",
    [
        ["T [us], GX (deg/s), gy, gz, ax, ay, az, l, r", "1000,1,2,3,0,0,1,500,0"],
        ["t:1000,gx:1,gy:2,gz:3,ax:0,ay:0,az:1,l:500,r:0"],
        ["ok", "t=1000\tgx=1\tgy=2\tgz=3\tax=0\tay=0\taz=1\tl=500\tr=0"],
    ],
)
def test_lines_are_named_as_in_logs(tmp_path: Path, lines: list[str]) -> None:
    decoder = lines_of(tmp_path)
    found = None
    for line in lines:
        try:
            found = decoder.decode(line)
        except FrameError:
            assert line == "ok"
    assert found is not None
    assert found.gyro == pytest.approx([math.radians(2), -math.radians(1), math.radians(3)])
    assert found.wheels[0] == pytest.approx(math.pi)


def test_a_date_is_no_time_of_a_port(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="one column, of numbers"):
        lines_of(tmp_path, COLUMNS.replace("time: t,", "time: [day, t],"))
