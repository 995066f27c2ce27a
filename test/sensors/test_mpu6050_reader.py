"""Every fault of the simulated chip, survived and counted by the reader."""

from __future__ import annotations

import dataclasses
import itertools
import math
import random
from typing import Any

import pytest

from twbr_estimation.errors import SensorError
from twbr_estimation.sensors.motion import swing
from twbr_estimation.sensors.mpu6050 import ImuReading, Mpu6050, Mpu6050Settings, Reading
from twbr_estimation.sensors.mpu6050_reader import Mpu6050Reader, Phase
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050

MODES = pytest.mark.parametrize("mode", list(Reading))


class Bench:
    """A chip, a reader and a clock turned by hand."""

    def __init__(self, clock: Any, mode: Reading, clock_rate: float = 1.0) -> None:
        self.clock = clock
        self.chip = SimulatedMpu6050(clock, clock_rate=clock_rate)
        settings = Mpu6050Settings(reading=mode, poll_rate=100.0, frozen_samples=50)
        self.reader = Mpu6050Reader(
            Mpu6050(self.chip, settings), clock, monotonic=clock, sleep=clock.advance
        )

    def run(self, seconds: float, period: float = 0.01) -> list[ImuReading]:
        """Poll at a steady period and return all samples."""
        found: list[ImuReading] = []
        for _ in range(round(seconds / period)):
            self.clock.advance(period)
            found.extend(self.reader.poll())
        return found

    def nonzero(self) -> dict[str, int]:
        """Return what was counted, samples left out."""
        counted = dataclasses.asdict(self.reader.counters)
        return {key: n for key, n in counted.items() if n and key != "samples"}


@pytest.fixture(params=list(Reading))
def bench(request: pytest.FixtureRequest, clock: Any) -> Bench:
    made = Bench(clock, request.param)
    assert made.reader.start() is None
    return made


def test_without_faults_nothing_is_counted_and_nothing_lost(bench: Bench) -> None:
    readings = bench.run(2.0)
    per_poll = 1 if bench.reader.counters.samples == 200 else 10
    assert len(readings) == 200 * per_poll
    assert bench.nonzero() == {}
    stamps = [reading.stamp for reading in readings]
    assert all(later > earlier for earlier, later in itertools.pairwise(stamps))


def test_samples_are_the_motion_of_the_chip_at_their_stamps(bench: Bench) -> None:
    readings = bench.run(2.0)
    errors = [reading.gyro_y - swing(reading.stamp * 1e-9).gyro_y for reading in readings]
    # 0.05 deg/s of noise; a stamp that is 1 ms off adds up to 0.05 deg/s.
    assert math.degrees(math.sqrt(sum(e * e for e in errors) / len(errors))) < 0.1


def test_a_short_disturbance_is_retried_without_losing_a_sample(bench: Bench) -> None:
    bench.run(0.1)
    bench.chip.nack(2)
    before = bench.reader.counters.samples
    per_poll = before // 10
    bench.run(0.1)
    assert bench.reader.counters.samples >= before + 10 * per_poll
    assert bench.nonzero() == {"bus_errors": 2}


def test_a_long_disturbance_ends_in_a_new_set_up(bench: Bench) -> None:
    bench.run(0.1)
    bench.chip.nack(18)
    assert bench.run(0.05, 0.01) == []
    bench.run(3.0)
    counted = bench.reader.counters
    assert bench.reader.phase is Phase.RUNNING
    assert counted.reinitialisations == 1 and counted.bus_errors == 18
    assert len(bench.run(0.1)) >= 10


def test_attempts_on_a_dead_bus_become_rare(bench: Bench) -> None:
    bench.chip.nack(10**9)
    bench.run(10.0)
    first = bench.reader.counters.bus_errors
    bench.run(10.0)
    assert bench.reader.phase is not Phase.RUNNING
    assert bench.reader.counters.bus_errors - first <= 6  # one attempt in 2 s
    bench.chip.nack(0)
    bench.run(2.5)
    assert bench.reader.phase is Phase.RUNNING


def test_a_brown_out_is_noticed_and_the_chip_set_up_again(bench: Bench) -> None:
    bench.run(0.1)
    bench.chip.brown_out()
    readings = bench.run(1.0)
    counted = bench.nonzero()
    counted.pop("invalid_packets", 0)  # zeros, with `burst`
    assert counted == {"lost_settings": 1, "reinitialisations": 1}
    assert readings, bench.reader.last_error
    assert all(reading.accel_z > 9.0 for reading in readings), "no sample of a sleeping chip"


def test_lost_ranges_are_noticed_although_the_chip_keeps_sampling(clock: Any) -> None:
    chip = SimulatedMpu6050(clock)
    settings = Mpu6050Settings(accel_range_g=8)
    reader = Mpu6050Reader(Mpu6050(chip, settings), clock, clock, clock.advance)
    reader.start()
    chip.write(0x1C, 0)
    for _ in range(200):
        clock.advance(0.01)
        reader.poll()
    assert reader.counters.lost_settings == 1
    assert chip.read(0x1C, 1) == bytes([2 << 3])


def test_a_frozen_sensor_is_noticed(bench: Bench) -> None:
    bench.run(0.1)
    bench.chip.frozen = True
    bench.run(1.0)
    assert bench.reader.counters.frozen >= 1
    bench.chip.frozen = False
    bench.run(0.5)
    assert bench.reader.phase is Phase.RUNNING
    assert len(bench.run(0.1)) >= 10


def test_a_clone_warns_and_delivers(clock: Any) -> None:
    bench = Bench(clock, Reading.BURST)
    bench.chip.identity = 0x70
    warning = bench.reader.start()
    assert warning is not None and "0x70" in warning
    assert len(bench.run(0.1)) == 10


def test_nothing_on_the_bus_is_an_error_at_the_start(clock: Any) -> None:
    bench = Bench(clock, Reading.BURST)
    bench.chip.nack(1)
    with pytest.raises(SensorError, match="/dev/i2c-1: nothing answers at 0x68"):
        bench.reader.start()


def test_a_fifo_overflow_is_counted_and_resynchronised(clock: Any) -> None:
    bench = Bench(clock, Reading.FIFO)
    bench.reader.start()
    bench.run(0.1)
    clock.advance(0.2)  # 200 samples, room for 73
    assert bench.reader.poll() == ()
    readings = bench.run(1.0)
    assert bench.nonzero() == {"fifo_overflows": 1, "fifo_resynchronisations": 1}
    assert 990 <= len(readings) <= 1010
    errors = [reading.accel_z - swing(reading.stamp * 1e-9).accel_z for reading in readings]
    assert max(map(abs, errors)) < 0.3, "a packet out of step would be off by far more"


def test_a_broken_fifo_transfer_does_not_shift_the_packets(clock: Any) -> None:
    bench = Bench(clock, Reading.FIFO)
    bench.reader.start()
    bench.run(0.1)

    class Torn:
        """Takes five bytes out of the FIFO and then fails, once."""

        def __init__(self, read: Any) -> None:
            self.read, self.done = read, False

        def __call__(self, register: int, length: int) -> bytes:
            if register == 0x74 and not self.done:
                self.done = True
                self.read(register, 5)
                raise OSError(121, "Remote I/O error")
            return bytes(self.read(register, length))

    bench.chip.read = Torn(bench.chip.read)  # type: ignore[method-assign]
    readings = bench.run(1.0)
    assert bench.reader.counters.fifo_resynchronisations == 1
    assert len(readings) >= 970
    errors = [reading.accel_z - swing(reading.stamp * 1e-9).accel_z for reading in readings]
    assert max(map(abs, errors)) < 0.3


def test_a_chip_that_stops_sampling_is_noticed(clock: Any) -> None:
    bench = Bench(clock, Reading.FIFO)
    bench.reader.start()
    bench.run(0.1)
    bench.chip.write(0x6A, 0)  # FIFO off, all settings intact
    bench.run(1.0)
    assert bench.reader.counters.silences == 1
    assert len(bench.run(0.1)) >= 90


def test_a_clock_that_is_set_back_is_survived(bench: Bench) -> None:
    bench.run(1.0)
    bench.clock.advance(-0.8)
    readings = bench.run(1.0)
    assert len(readings) >= 90
    assert bench.reader.phase is Phase.RUNNING
    assert readings[-1].stamp == pytest.approx(bench.clock(), abs=2e6)


@pytest.mark.parametrize("clock_rate", [0.99, 1.013])
def test_fifo_stamps_follow_the_clock_of_the_chip(clock: Any, clock_rate: float) -> None:
    bench = Bench(clock, Reading.FIFO, clock_rate)
    bench.reader.start()
    jitter = random.Random(3)
    errors, taken = [], 0
    for _ in range(2000):
        clock.advance(0.01 + jitter.uniform(0.0, 0.001))
        for reading in bench.reader.poll():
            taken += 1
            errors.append(reading.stamp - bench.chip.sample_time(taken))
    settled = errors[10_000:]
    assert bench.reader.sample_clock.drift == pytest.approx(1.0 / clock_rate - 1.0, abs=2e-4)
    assert max(settled) < 1e5
    assert min(settled) > -1e5  # 0.1 ms, a tenth of the sampling period
    assert bench.nonzero() == {}
