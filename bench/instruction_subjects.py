"""What `bench/instructions.py` counts: parts of the live path and whole nodes, each run so often.

Devices are replaced by ones that answer from memory and clocks by ones that advance by a period a
turn, so that the counts are those of the product and the same on every machine.
"""

from __future__ import annotations

import gc
import itertools
import math
import os
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import instruction_code

from twbr_estimation.checks.quick import QuickChecks
from twbr_estimation.filters.base import filter_named
from twbr_estimation.live_code.providing import compiled_correction, compiled_filter
from twbr_estimation.pipeline.correction import Corrector
from twbr_estimation.pipeline.pairing import wheel_reading
from twbr_estimation.pipeline.tilt_filter import TiltFilter
from twbr_estimation.pipeline.watched_filter import WatchedFilter
from twbr_estimation.robot import Setup
from twbr_estimation.samples import CorrectedSample, Sample
from twbr_estimation.sensors.encoder import Encoder, EncoderSettings
from twbr_estimation.sensors.mpu6050 import Mpu6050, Mpu6050Settings, Reading
from twbr_estimation.sensors.mpu6050_reader import Mpu6050Reader
from twbr_estimation.sensors.mpu6050_registers import PACKET_BYTES, Register
from twbr_estimation.streams.correction import CorrectionStream

Run = Callable[[int], None]
MILLISECOND = 1_000_000
FIFO_BLOCK = 5
"""Packets in the FIFO at each read: 1 kHz read at 200 Hz."""
FIRST = 1_700_000_000_000_000_000
"""Stamp of the first sample [ns]."""


PERIOD = 2.0
"""Period of the swing [s]; all that is stored is of this length."""
FREQUENCY = 2.0 * math.pi / PERIOD


def tilt_at(seconds: float) -> float:
    """Return the tilt [rad]."""
    return 0.05 * math.sin(FREQUENCY * seconds)


def swing(seconds: float) -> tuple[float, ...]:
    """Return gyro and accelerometer of a robot that swings by 3 deg, with some noise."""
    tilt, rate = tilt_at(seconds), 0.05 * FREQUENCY * math.cos(FREQUENCY * seconds)
    noise = 0.02 * math.sin(997.0 * seconds)
    return noise, rate + noise, -noise, -9.81 * math.sin(tilt) + noise, noise, 9.81 * math.cos(tilt)


def turned(seconds: float) -> float:
    """Return the angle of a wheel that stands on the ground, by an encoder on the body [rad]."""
    return -tilt_at(seconds)


def packets(period: float) -> list[bytes]:
    """Return packets of a chip with the default ranges, one a period [s]."""
    settings = Mpu6050Settings()
    found = []
    for index in range(round(PERIOD / period)):
        values = swing(index * period)
        gyro = (round(each / settings.gyro_scale) for each in values[:3])
        accel = (round(each / settings.accel_scale) for each in values[3:])
        found.append(struct.pack(">7h", *accel, -2000 + index % 7, *gyro))
    return found


class StoredChip:
    """Registers of a chip whose packets lie in memory: what the bus would bring."""

    def __init__(self, period: float) -> None:
        """Give a packet a period [s]."""
        stored = packets(period)
        self._packets = itertools.cycle(stored)
        size = FIFO_BLOCK
        joined = [b"".join(stored[i : i + size]) for i in range(0, len(stored) - size, size)]
        self._blocks = itertools.cycle(joined)
        self._count = struct.pack(">H", size * PACKET_BYTES)
        self._written: dict[int, int] = {}

    def read(self, register: int, length: int) -> bytes:
        """Answer at once."""
        if register == Register.FIFO_R_W:
            return next(self._blocks)
        if register == Register.FIFO_COUNT_H:
            return self._count
        if register == Register.ACCEL_XOUT_H:
            return next(self._packets)
        if register == Register.WHO_AM_I:
            return b"\x68"
        if register == Register.INT_STATUS:
            return b"\0"
        return bytes(self._written.get(register + index, 0) for index in range(length))

    def write(self, register: int, value: int) -> None:
        """Keep it."""
        self._written[register] = value

    def close(self) -> None:
        """Release nothing."""


class StoredCounter:
    """A counter whose counts lie in memory."""

    modulus = 2**32
    errors = ambiguous = behind = 0
    remark = ""
    zeroed_by_index = False

    def __init__(self, period: float) -> None:
        """Give a count a period [s]."""
        scale = EncoderSettings().angle_per_count
        counts = [
            round(turned(index * period) / scale) % self.modulus
            for index in range(round(PERIOD / period))
        ]
        self._counts = itertools.cycle(counts)

    def read(self) -> int:
        """Return the next count."""
        return next(self._counts)

    def index(self) -> int | None:
        """There is none."""
        return None

    def close(self) -> None:
        """Release nothing."""


class Ticks:
    """A clock that stands still until it is set forward."""

    def __init__(self) -> None:
        """Begin at `FIRST`."""
        self.now = FIRST

    def __call__(self) -> int:
        """Return the time [ns]."""
        return self.now


def chip_settings(reading: str, poll_rate: float) -> Mpu6050Settings:
    """Return the set-up of the chip: 1 kHz."""
    return Mpu6050Settings(reading=Reading(reading), poll_rate=poll_rate)


def _read(reading: str, poll_rate: float) -> Run:
    ticks, period = Ticks(), round(1e9 / poll_rate)
    chip = StoredChip(0.001 if reading == "fifo" else 1.0 / poll_rate)
    device = Mpu6050(chip, chip_settings(reading, poll_rate))
    reader = Mpu6050Reader(device, ticks, ticks, sleep=lambda seconds: None)
    reader.start()

    def run(count: int) -> None:
        for _ in range(count):
            ticks.now += period
            reader.poll()
        assert reader.running, reader.last_error

    return run


def read_burst() -> Run:
    """Read one packet."""
    return _read("burst", 500.0)


def read_fifo() -> Run:
    """Read five packets out of the FIFO."""
    return _read("fifo", 200.0)


def read_encoders() -> Run:
    """Read two encoders."""
    encoders = [Encoder(StoredCounter(0.005), EncoderSettings()) for _ in range(2)]
    stamps = itertools.count(FIRST, 5 * MILLISECOND)

    def run(count: int) -> None:
        for stamp in itertools.islice(stamps, count):
            for encoder in encoders:
                encoder.read(stamp)

    return run


def raw_samples(period: float, with_wheels: bool = True) -> Iterator[Sample]:
    """Return the samples of `swing`, over and over."""
    stored = []
    for index in range(round(PERIOD / period)):
        seconds = index * period
        wheels = (turned(seconds), 0.0, 2.0) if with_wheels else (0.0, 0.0, 0.0)
        stored.append(Sample(*(period, *swing(seconds), *wheels)))
    return itertools.cycle(stored)


def corrected_samples(period: float) -> Iterator[CorrectedSample]:
    """Return the same, corrected."""
    corrector, raw = Corrector(Setup()), raw_samples(period)
    return itertools.cycle([corrector.step(next(raw)) for _ in range(round(PERIOD / period))])


def _each(take: Callable[[Any], Any], samples: Iterator[Any]) -> Run:
    take(next(samples))

    def run(count: int) -> None:
        for sample in itertools.islice(samples, count):
            take(sample)

    return run


def correction_step() -> Run:
    """Correct one sample."""
    return _each(Corrector(Setup()).step, raw_samples(0.005))


def correction_stream() -> Run:
    """Guard, pair and correct a sample and a wheel reading of the same stamp."""
    stream = CorrectionStream(Setup())
    stored = [swing(index * 0.005) for index in range(400)]
    angles = [turned(index * 0.005) for index in range(400)]
    values, wheels = itertools.cycle(stored), itertools.cycle(angles)
    stamps = itertools.count(FIRST, 5 * MILLISECOND)

    def run(count: int) -> None:
        for stamp in itertools.islice(stamps, count):
            angle = next(wheels)
            stream.add_wheels(wheel_reading(stamp, (angle, angle)))
            stream.add_imu(stamp, next(values))

    return run


def filter_step() -> Run:
    """Step `ins_odometer` at 200 Hz."""
    return _each(TiltFilter(filter_named("ins_odometer")).step, corrected_samples(0.005))


def filter_step_1khz() -> Run:
    """Step `ins_odometer` at 1 kHz."""
    return _each(TiltFilter(filter_named("ins_odometer")).step, corrected_samples(0.001))


def watched_filter() -> Run:
    """Step it and judge it."""
    return _each(WatchedFilter(filter_named("ins_odometer")).step, corrected_samples(0.005))


def compiled_correction_step() -> Run:
    """Correct one sample by machine code."""
    corrector, code = Corrector(Setup()), compiled_correction()
    assert code is not None, "no machine code"
    corrector.use(code)
    return _each(corrector.step, raw_samples(0.005))


def compiled_watched_filter() -> Run:
    """Step `ins_odometer` and judge it by machine code."""
    entry = filter_named("ins_odometer")
    watched, code = WatchedFilter(entry), compiled_filter(entry)
    assert code is not None, "no machine code"
    watched.use(code)
    return _each(watched.step, corrected_samples(0.005))


def quick_checks() -> Run:
    """Compare the sensors with each other."""
    return _each(QuickChecks().add, corrected_samples(0.005))


def subjects() -> dict[str, Callable[[], Run]]:
    """Return everything that can be counted, by name."""
    parts: Sequence[Callable[[], Run]] = (
        read_burst,
        read_fifo,
        read_encoders,
        correction_step,
        correction_stream,
        filter_step,
        filter_step_1khz,
        watched_filter,
        compiled_correction_step,
        compiled_watched_filter,
        quick_checks,
    )
    found = {part.__name__: part for part in parts}
    try:
        from instruction_nodes import NODES
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("rclpy", "sensor_msgs", "std_msgs"):
            raise
        return found
    return {**found, **NODES}


def form() -> str:
    """Return how the steps of this process run; empty where there are none."""
    steps = [each for each in gc.get_objects() if isinstance(each, (Corrector, TiltFilter))]
    found = {
        "correction" if isinstance(each, Corrector) else "filter": getattr(each, "_in_code", False)
        for each in steps
        if isinstance(each, TiltFilter) or each._state is not None
    }
    return ", ".join(
        f"{name} {'machine code' if compiled else 'interpreted'}"
        for name, compiled in sorted(found.items())
    )


def count_from_here() -> None:
    """Let callgrind begin to count; without that a process is slowed down much less."""
    command = ["callgrind_control", "--instr=on", str(os.getpid())]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def count(part: str, turns: int, in_callgrind: bool) -> None:
    """Run a part, between two marks for the counter; print how its steps ran."""
    instruction_code.use_folder()
    run = subjects()[part]()
    run(turns // 5)
    if in_callgrind:
        count_from_here()
    os.getpriority(os.PRIO_PROCESS, 0)
    run(turns)
    os.getpriority(os.PRIO_PROCESS, 0)
    print(form(), flush=True)
    os._exit(0)  # what comes after is not worth its time under an emulation


if __name__ == "__main__":
    count(sys.argv[1], int(sys.argv[2]), "callgrind" in sys.argv[3:])
