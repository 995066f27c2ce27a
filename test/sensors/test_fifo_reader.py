"""The FIFO under stalls, odd chips and odd adapters: whole packets or none."""

from __future__ import annotations

import errno
from typing import Any

import pytest

from twbr_estimation.errors import ConfigurationError
from twbr_estimation.sensors.chip_models import MODELS
from twbr_estimation.sensors.motion import ImuMotion
from twbr_estimation.sensors.mpu6050 import (
    ImuReading,
    Mpu6050,
    Mpu6050Settings,
    Reading,
    Register,
)
from twbr_estimation.sensors.mpu6050_reader import Mpu6050Reader
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050

FELT = ImuMotion(1.0, -2.0, 3.0, 2.0, -4.0, 9.0, 31.0)
IDENTITIES = [*MODELS, 0x42]
KINDS = [0x68, 0x70, 0x12, 0x98, 0x42]
"""One chip of each size and set-up of the FIFO."""


class Stalling(SimulatedMpu6050):
    """A chip whose reader stalls before or after its count is read."""

    before_count = before_data = after_data = 0.0
    """Stalls to come [s], each once."""
    limit = 10**6
    """Bytes that the adapter reads in one transfer."""
    capacity = 0
    """Bytes in a FIFO that is smaller than its model's; 0 for that of the model."""
    failing = -1
    """Register whose next reads fail."""
    failures = 0
    """Number of these reads."""

    @property
    def _capacity(self) -> int:
        return self.capacity or super()._capacity

    def _stall(self, name: str) -> None:
        self._clock.advance(getattr(self, name))  # type: ignore[attr-defined]
        setattr(self, name, 0.0)

    def read(self, register: int, length: int) -> bytes:
        if length > self.limit:
            raise OSError(errno.EOPNOTSUPP, "Operation not supported")
        if register == self.failing and self.failures:
            self.failures -= 1
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
        if register == Register.FIFO_COUNT_H:
            self._stall("before_count")
        if register == Register.FIFO_R_W:
            self._stall("before_data")
        data = super().read(register, length)
        if register == Register.FIFO_R_W:
            self._stall("after_data")
        return data


class Bench:
    def __init__(self, clock: Any, identity: int = 0x68, **settings: Any) -> None:
        self.clock = clock
        self.chip = Stalling(clock, motion=lambda _: FELT, identity=identity)
        given = Mpu6050Settings(**{"reading": Reading.FIFO, "poll_rate": 100.0, **settings})
        self.reader = Mpu6050Reader(
            Mpu6050(self.chip, given), clock, monotonic=clock, sleep=clock.advance
        )

    def run(self, seconds: float) -> list[ImuReading]:
        found: list[ImuReading] = []
        for _ in range(round(seconds / 0.01)):
            self.clock.advance(0.01)
            found.extend(self.reader.poll())
        return found


def _torn(readings: list[ImuReading]) -> int:
    """Count readings that differ from the chip's motion."""
    return sum(
        max(abs(found - true) for found, true in zip(each[1:7], FELT, strict=False)) > 0.5
        for each in readings
    )


@pytest.mark.parametrize("identity", KINDS)
@pytest.mark.parametrize("stall", ["before_count", "before_data", "after_data"])
@pytest.mark.parametrize("seconds", [0.03, 0.0641, 0.9])
def test_a_stall_anywhere_publishes_no_torn_packet(
    clock: Any, identity: int, stall: str, seconds: float
) -> None:
    bench = Bench(clock, identity)
    bench.reader.start()
    bench.run(0.1)
    setattr(bench.chip, stall, seconds)
    readings = bench.run(0.5)
    assert _torn(readings) == 0
    assert len(readings) > 400
    if seconds > 0.5:
        assert bench.reader.counters.fifo_overflows >= 1
        assert "FIFO overflow" in bench.reader.last_error


@pytest.mark.parametrize("capacity", [1020, 896, 512])
@pytest.mark.parametrize("stall", ["before_count", "before_data", "after_data"])
def test_a_copy_with_a_smaller_fifo_publishes_no_torn_packet(
    clock: Any, capacity: int, stall: str
) -> None:
    bench = Bench(clock)
    bench.chip.capacity = capacity
    bench.reader.start()
    readings = bench.run(0.1)
    for seconds in (0.03, 0.0641, 0.3, 0.9):
        setattr(bench.chip, stall, seconds)
        readings += bench.run(0.5)
        late = clock() - readings[-1].stamp
        assert 0 <= late < 3_000_000, "stamps follow the clock"
    assert _torn(readings) == 0
    assert len(readings) > 1600


@pytest.mark.parametrize(
    "register", [Register.INT_STATUS, Register.FIFO_COUNT_H, Register.FIFO_R_W, Register.USER_CTRL]
)
@pytest.mark.parametrize("failures", [1, 3, 4])
def test_transfers_that_fail_in_a_poll_move_no_stamp(
    clock: Any, register: int, failures: int
) -> None:
    bench = Bench(clock)
    bench.reader.start()
    readings = bench.run(1.0)
    bench.chip.failing, bench.chip.failures = register, failures
    readings += bench.run(0.2)
    assert bench.reader.running
    true = [round(bench.chip.sample_time(index)) for index in range(1300)]
    assert all(min(abs(each.stamp - time) for time in true) < 600_000 for each in readings)
    assert 0 <= clock() - readings[-1].stamp < 2_000_000
    assert _torn(readings) == 0


def test_two_stalls_in_one_poll_do_not_tear_packets_for_ever(clock: Any) -> None:
    bench = Bench(clock)
    bench.reader.start()
    bench.run(0.2)
    bench.chip.before_count = bench.chip.before_data = 0.04
    readings = bench.run(5.0)
    assert _torn(readings) == 0
    assert bench.reader.counters.fifo_overflows == 1
    assert len(readings) > 4800


def test_a_fifo_out_of_step_without_a_flag_is_resynchronised(clock: Any) -> None:
    bench = Bench(clock)
    bench.reader.start()
    bench.run(0.1)
    clock.advance(0.005)
    bench.chip.read(Register.FIFO_R_W, 2)  # two bytes are gone, and no flag says so
    readings = bench.run(1.0)
    assert _torn(readings) == 0
    assert bench.reader.counters.fifo_resynchronisations == 1
    assert "out of step: 12 bytes" in bench.reader.last_error
    assert len(readings) > 950


def test_a_count_read_while_the_chip_writes_is_read_again(clock: Any) -> None:
    bench = Bench(clock)
    bench.reader.start()
    bench.run(0.1)
    read, half_written = bench.chip.read, [5, 4, 3, 2, 1]

    def writing(register: int, length: int) -> bytes:
        data = read(register, length)
        if register == Register.FIFO_COUNT_H and half_written and half_written.pop() % 2:
            return (int.from_bytes(data, "big") + 6).to_bytes(2, "big")
        return data

    bench.chip.read = writing  # type: ignore[method-assign]
    assert len(bench.run(0.1)) == 100
    assert bench.reader.counters.fifo_resynchronisations == 0


def test_what_fills_up_before_the_first_poll_is_no_overflow(clock: Any) -> None:
    bench = Bench(clock)
    bench.reader.start()
    clock.advance(0.7)
    assert bench.reader.poll() == ()
    readings = bench.run(1.0)
    assert bench.reader.counters.fifo_overflows == 0
    assert bench.reader.counters.fifo_resynchronisations == 0
    assert _torn(readings) == 0
    assert len(readings) >= 990


@pytest.mark.parametrize("limit", [14, 60, 255])
def test_an_adapter_of_few_bytes_gives_every_sample(clock: Any, limit: int) -> None:
    bench = Bench(clock, poll_rate=20.0)
    bench.chip.limit = limit
    bench.reader.start()
    readings: list[ImuReading] = []
    for _ in range(20):
        clock.advance(0.05)
        readings.extend(bench.reader.poll())
    assert len(readings) == 1000
    assert _torn(readings) == 0
    assert bench.reader.fifo.transfer_packets * 14 <= limit
    assert bench.reader.counters.fifo_resynchronisations == 0


def test_a_count_that_no_chip_has_is_a_disturbed_transfer(clock: Any) -> None:
    bench = Bench(clock)
    bench.reader.start()
    bench.run(0.1)
    read, wrong = bench.chip.read, [1]

    def disturbed(register: int, length: int) -> bytes:
        data = read(register, length)
        return b"\x7f\xff" if register == Register.FIFO_COUNT_H and wrong and wrong.pop() else data

    bench.chip.read = disturbed  # type: ignore[method-assign]
    assert len(bench.run(0.1)) == 100
    assert bench.reader.counters.bus_errors == 1


def test_the_poll_rate_must_fit_the_chip_s_fifo(clock: Any) -> None:
    assert Bench(clock, 0x68, poll_rate=20.0).reader.start() is None
    with pytest.raises(ConfigurationError, match=r"poll_rate: 20 Hz.*36 samples.*MPU6500.*28 Hz"):
        Bench(clock, 0x70, poll_rate=20.0).reader.start()


def test_counters_go_on_with_a_new_reader(clock: Any) -> None:
    bench = Bench(clock)
    bench.reader.start()
    bench.run(0.1)
    before = bench.reader.counters
    before.bus_errors = 20
    again = Mpu6050Reader(
        Mpu6050(bench.chip, Mpu6050Settings()), clock, clock, clock.advance, before
    )
    again.start()
    assert again.counters.bus_errors == 20
    assert again.counters.samples == 100


@pytest.mark.parametrize("identity", IDENTITIES)
def test_relatives_are_set_up_as_what_they_are(clock: Any, identity: int) -> None:
    bench = Bench(clock, identity, dlpf_config=3, sample_rate_divider=0)
    remark = bench.reader.start()
    assert (remark is None) == (identity == 0x68)
    if remark is not None:
        assert f"0x{identity:02x}" in remark
    readings = bench.run(0.5)
    assert readings[-1].temperature == pytest.approx(31.0, abs=0.1)
    low_pass = bench.chip.read(Register.ACCEL_CONFIG_2, 1)[0]
    assert low_pass == (0 if identity in (0x68, 0x72, 0x42) else 3)


@pytest.mark.parametrize(
    ("identity", "raw", "degrees"),
    [
        (0x68, 0, 36.53),
        (0x68, -3920, 25.0),
        (0x70, 0, 21.0),
        (0x71, 1335, 25.0),
        (0x73, 1335, 25.0),
        (0x12, 3268, 35.0),
        (0x19, 0, 25.0),
        (0x98, -1634, 20.0),
    ],
)
def test_temperatures_of_the_data_sheets(identity: int, raw: int, degrees: float) -> None:
    assert MODELS[identity].temperature(raw) == pytest.approx(degrees, abs=0.01)
