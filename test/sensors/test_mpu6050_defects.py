"""Half-broken chips and buses: what is no sample is dropped, what is broken is said."""

from __future__ import annotations

import struct
from collections.abc import Callable
from itertools import groupby
from typing import Any

import pytest

from twbr_estimation.sensors.motion import ImuMotion, swing
from twbr_estimation.sensors.mpu6050 import ImuReading, Mpu6050, Mpu6050Settings, Reading
from twbr_estimation.sensors.mpu6050_reader import Mpu6050Reader
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050

WORDS = struct.Struct(">7h")
Change = Callable[[list[int]], None]


class Altered(SimulatedMpu6050):
    """A chip whose packets, or the bus it hangs on, can be altered."""

    change: Change | None = None
    """Alters the words of a new sample."""
    on_the_bus: Callable[[int, bytes], bytes] | None = None
    """Alters what a read gives, from the register and the true bytes."""

    def _packet(self, seconds: float) -> bytes:
        words = list(WORDS.unpack(super()._packet(seconds)))
        if self.change is not None:
            self.change(words)
        return WORDS.pack(*words)

    def read(self, register: int, length: int) -> bytes:
        data = super().read(register, length)
        return data if self.on_the_bus is None else self.on_the_bus(register, data)


class Bench:
    def __init__(self, clock: Any, mode: Reading, chip: Any = None, **settings: Any) -> None:
        self.clock = clock
        self.chip = Altered(clock) if chip is None else chip
        self.settings = Mpu6050Settings(reading=mode, poll_rate=100.0, **settings)
        self.reader = Mpu6050Reader(
            Mpu6050(self.chip, self.settings), clock, monotonic=clock, sleep=clock.advance
        )
        self.reader.start()

    def run(self, seconds: float) -> list[ImuReading]:
        found: list[ImuReading] = []
        for _ in range(round(seconds / 0.01)):
            self.clock.advance(0.01)
            found.extend(self.reader.poll())
        return found


@pytest.fixture(params=list(Reading))
def bench(request: pytest.FixtureRequest, clock: Any) -> Bench:
    return Bench(clock, request.param)


def _wrong(readings: list[ImuReading]) -> int:
    """Count readings far from the motion of the swinging robot."""
    return sum(abs(each.accel_z - swing(each.stamp * 1e-9).accel_z) > 1.0 for each in readings)


@pytest.mark.parametrize("level", [0x00, 0xFF])
@pytest.mark.parametrize("first", [0, 6])
def test_a_bus_let_go_gives_no_samples(bench: Bench, level: int, first: int) -> None:
    bench.run(1.0)
    bench.chip.on_the_bus = lambda _, data: data[:first] + bytes([level]) * len(data[first:])
    readings = bench.run(0.5)
    counted = bench.reader.counters
    if first == 0:
        assert readings == []
        assert counted.reinitialisations >= 1
    bench.chip.on_the_bus = None
    later = bench.run(3.0)
    assert _wrong(readings + later) == 0
    assert len(later) > 90
    assert bench.reader.last_error


def test_the_zeros_of_a_chip_that_wakes_up_are_dropped(clock: Any) -> None:
    chip = Altered(clock)
    bench = Bench(clock, Reading.BURST, chip)
    taken = []
    chip.change = lambda words: words.__setitem__(slice(None), [0] * 7) if not taken else None
    clock.advance(0.001)
    assert bench.reader.poll() == ()
    taken.append(True)
    assert bench.reader.counters.invalid_packets == 1
    assert bench.reader.running
    assert len(bench.run(0.1)) == 10


@pytest.mark.parametrize(
    ("axes", "value", "words"),
    [
        ((4, 5, 6), 0, "gyro x, y, z stuck at 0 deg/s"),
        ((5,), 12, "gyro y stuck at 0.3662 deg/s"),
        ((2,), 4000, "accelerometer z stuck at 0.9766 g"),
        ((0, 1, 2), -100, "accelerometer x, y, z stuck at"),
        ((5,), 32767, "gyro y at full scale 1000 deg/s"),
        ((2,), -32768, "accelerometer z at full scale -8 g"),
    ],
)
def test_a_dead_axis_is_named(bench: Bench, axes: tuple[int, ...], value: int, words: str) -> None:
    bench.run(1.0)

    def stick(packet: list[int]) -> None:
        for axis in axes:
            packet[axis] = value

    bench.chip.change = stick
    readings = bench.run(5.0)
    counted = bench.reader.counters
    assert words in bench.reader.defect
    assert words in bench.reader.last_error
    assert counted.stuck_words == len(axes)
    full_scale = value in (32767, -32768)
    assert bench.reader.broken is not full_scale
    assert counted.reinitialisations == (not full_scale), "one reset may cure it; more would not"
    assert len(readings) > 300, "they go on, flagged"
    bench.chip.change = None
    bench.run(3.0)
    assert bench.reader.defect == ""


@pytest.mark.parametrize("dlpf", [0, 3, 6])
@pytest.mark.parametrize(("gyro", "accel"), [(250, 2), (2000, 16)])
def test_a_quiet_chip_at_rest_is_not_taken_for_a_broken_one(
    clock: Any, dlpf: int, gyro: int, accel: int
) -> None:
    # The noise that the data sheet gives for this filter, relative to the simulated chip's.
    noise = ((256.0, 188.0, 98.0, 42.0, 20.0, 10.0, 5.0)[dlpf] / 256.0) ** 0.5
    still = ImuMotion(0.001, -0.002, 0.003, 0.1, 0.2, 9.8)
    chip = Altered(clock, motion=lambda _: still, noise=noise)
    bench = Bench(
        clock, Reading.BURST, chip, dlpf_config=dlpf, gyro_range_deg=gyro, accel_range_g=accel
    )
    readings = bench.run(25.0)  # two windows of the slowest filter
    assert bench.reader.counters.stuck_words == 0
    assert len(readings) > 2450


def test_without_noise_an_axis_is_suspected_when_the_others_move(clock: Any) -> None:
    moving: list[float] = []

    def motion(seconds: float) -> ImuMotion:
        felt = swing(seconds) if moving else ImuMotion(0.0, 0.0, 0.0, 0.0, 0.0, 9.8)
        return felt._replace(accel_x=felt.accel_x + 3.0 * bool(moving) * (seconds % 7.0 > 3.0))

    chip = Altered(clock, motion=motion, noise=0.05)
    bench = Bench(clock, Reading.BURST, chip, dlpf_config=6, gyro_range_deg=2000)
    chip.change = lambda words: words.__setitem__(slice(4, 7), [0, 0, 0])
    bench.run(11.0)
    assert bench.reader.defect == ""
    moving.append(1.0)
    bench.run(25.0)
    assert "gyro x, y, z stuck at 0" in bench.reader.defect


def test_a_frozen_chip_repeats_itself_only_a_few_times(bench: Bench) -> None:
    bench.run(1.0)
    bench.chip.frozen = True
    frozen = bench.run(3.0)  # a reset gives fresh samples, then the next one sticks
    held = bench.reader.counters
    longest = max(len(list(equal)) for _, equal in groupby(each[1:] for each in frozen))
    assert longest <= 3
    assert held.repeated_packets > 100
    assert held.frozen >= 2, "a reset is tried again and again"
    bench.chip.frozen = False
    later = bench.run(1.0)
    assert _wrong(later) == 0
    assert len(later) > 80


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_short_reads_are_broken_transfers(bench: Bench, share: float) -> None:
    bench.run(1.0)
    count = [0]

    def shorten(_: int, data: bytes) -> bytes:
        count[0] += 1
        return data[: len(data) // 2] if count[0] % round(1 / share) == 0 else data

    bench.chip.on_the_bus = shorten
    readings = bench.run(1.0)
    assert bench.reader.counters.bus_errors > 0
    if share == 1.0:
        assert readings == []
    bench.chip.on_the_bus = None
    later = bench.run(3.0)
    assert _wrong(readings + later) == 0
    assert len(later) > 90


def test_a_torn_packet_is_read_again(clock: Any) -> None:
    bench = Bench(clock, Reading.BURST)
    bench.run(1.0)
    count = [0]

    def tear(register: int, data: bytes) -> bytes:
        count[0] += register == 0x3B
        torn = register == 0x3B and count[0] % 7 == 0
        return data[:4] + bytes([data[4] ^ 0x40]) + data[5:] if torn else data

    bench.chip.on_the_bus = tear
    readings = bench.run(2.0)
    assert len(readings) == 200
    assert _wrong(readings) == 0
    assert bench.reader.counters.torn_reads > 20


def test_settings_are_not_lost_by_one_torn_read(bench: Bench) -> None:
    bench.run(0.1)
    torn = [1]

    def tear(register: int, data: bytes) -> bytes:
        if register == 0x19 and torn:
            torn.pop()
            return b"\x55" * len(data)
        return data

    bench.chip.on_the_bus = tear
    bench.run(2.0)
    assert bench.reader.counters.torn_reads == 1
    assert bench.reader.counters.lost_settings == 0


def test_an_impact_is_not_mistaken_for_a_torn_packet(clock: Any) -> None:
    start = clock()

    def hit(seconds: float) -> ImuMotion:
        struck = 0.505 < seconds - start * 1e-9 < 0.525
        return ImuMotion(0.0, 5.0 * struck, 0.0, 40.0 * struck, 0.0, 9.8)

    bench = Bench(clock, Reading.BURST, Altered(clock, motion=hit))
    readings = bench.run(1.0)
    assert sum(abs(each.accel_x) > 30.0 for each in readings) == 2
    assert bench.reader.counters.torn_reads == 0
