"""Keeps an MPU6050 delivering: retries, sets it up again, and counts what went wrong."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

from ..errors import SensorError
from .mpu6050 import FIFO_BYTES, PACKET_BYTES, RESET_TIME, ImuReading, Mpu6050, Reading
from .sample_clock import SampleClock

Stamped = TypeVar("Stamped")

RETRIES = 2
RETRY_PAUSE = 0.0005
"""Pause before the first retry of a transfer [s]; it doubles with each."""
FAILED_POLLS = 5
"""Polls in a row that fail before the chip is set up again."""
FIRST_WAIT = 0.1
LONGEST_WAIT = 2.0
"""Waits between attempts to set the chip up, doubling from the first [s]."""
CHECK_PERIOD = 1.0
"""Time between two looks at the chip's settings [s]."""
SILENCE = 0.25
"""Time without a sample in the FIFO that means the chip has stopped [s]."""
SLOW_TRANSFER = 0.002
"""Duration of reading the FIFO's count beyond which its time is not trusted [s]."""


class Phase(Enum):
    """What the reader is doing."""

    STOPPED = "stopped"
    RUNNING = "running"
    RESETTING = "resetting"
    """The reset bit is set; the chip needs a moment."""
    WAITING = "waiting for the bus"


@dataclass(slots=True)
class Counters:
    """What happened since the start."""

    samples: int = 0
    bus_errors: int = 0
    failed_polls: int = 0
    """Polls that gave no sample although the transfer was retried."""
    reinitialisations: int = 0
    lost_settings: int = 0
    """Times the chip was found without its settings, as after a brown-out."""
    frozen: int = 0
    """Times the same sample came again and again."""
    silences: int = 0
    fifo_overflows: int = 0
    fifo_resynchronisations: int = 0
    """Times the FIFO was emptied: after an overflow or a broken transfer."""
    clock_jumps: int = 0


class Mpu6050Reader:
    """Delivers samples at each `poll`, and never raises because of the bus.

    Two clocks are used: `clock` stamps samples and may be set; `monotonic` measures waits.
    """

    def __init__(
        self,
        device: Mpu6050,
        clock: Callable[[], int],
        monotonic: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._device = device
        self._clock = clock
        self._monotonic = monotonic
        self._sleep = sleep
        self._fifo = device.settings.reading is Reading.FIFO
        self._limit = device.settings.frozen_samples
        self.sample_clock = SampleClock(1.0 / device.settings.sample_rate)
        """Relation between the chip's clock and the host's, with `fifo`."""
        self.phase = Phase.STOPPED
        self.counters = Counters()
        self.failed_attempts = 0
        """Attempts in a row to set the chip up that failed."""
        self.last_error = ""
        """The latest thing that went wrong, in words."""
        self._last_packet = b""
        self._repeats = 0
        self._torn = False
        self._failures = 0
        self._wait = FIRST_WAIT
        self._next = 0
        self._next_check = 0
        self._silent_since = 0

    def start(self) -> str | None:
        """Identify the chip, reset it and set it up; takes a good `RESET_TIME`.

        Returns:
            A warning about a chip that is not an MPU6050, or None.

        Raises:
            SensorError: the chip does not answer or does not keep its settings.
        """
        try:
            warning = self._device.identify()
            self._device.reset()
            self._sleep(RESET_TIME)
            self._device.configure()
        except OSError as error:
            settings = self._device.settings
            raise SensorError(
                f"/dev/i2c-{settings.bus}: nothing answers at 0x{settings.address:02x} ({error})"
            ) from None
        self._run()
        return warning

    def poll(self) -> Sequence[ImuReading]:
        """Return the samples since the last poll: none, one (`burst`) or several (`fifo`)."""
        if not self.running:
            self._recover()
            return ()
        try:
            readings = self._read_fifo() if self._fifo else self._read_burst()
            if self._monotonic() >= self._next_check:
                self._check()
        except OSError as error:
            self._failed(error)
            return ()
        return self._accepted(readings)

    def _accepted(self, readings: Sequence[ImuReading]) -> Sequence[ImuReading]:
        """Count the samples, unless the chip was meanwhile found without its settings."""
        if not self.running:
            return ()
        self._failures = 0
        self.counters.samples += len(readings)
        return readings

    @property
    def running(self) -> bool:
        """Whether samples are being delivered."""
        return self.phase is Phase.RUNNING

    def _read_burst(self) -> Sequence[ImuReading]:
        stamp, packet = self._with_retries(self._stamped_packet)
        if self._suspicious(packet):
            return ()
        return (self._device.decode(stamp, packet),)

    def _stamped_packet(self) -> tuple[int, bytes]:
        stamp = self._clock()
        return stamp, self._device.read_packet()

    def _stamped_count(self) -> tuple[int, int, bool]:
        begin = self._clock()
        count = self._device.fifo_count()
        return begin, count, self._clock() - begin < SLOW_TRANSFER * 1e9

    def _read_fifo(self) -> Sequence[ImuReading]:
        if self._torn:
            self._resynchronise("FIFO emptied after a broken transfer")
            return ()
        now, count, trusted = self._with_retries(self._stamped_count)
        if count > FIFO_BYTES - PACKET_BYTES:
            self.counters.fifo_overflows += 1
            self._resynchronise("FIFO overflow: samples lost, reading too slowly")
            return ()
        packets = count // PACKET_BYTES
        if packets == 0:
            self._notice_silence()
            return ()
        # Not retried: a transfer that breaks may have taken bytes out and torn a packet.
        self._torn = True
        data = self._device.read_fifo(packets)
        self._torn = False
        self._silent_since = self._monotonic()
        stamps = self.sample_clock.stamps(packets, now, trusted)
        self.counters.clock_jumps = self.sample_clock.jumps
        for index in range(packets):
            packet = data[index * PACKET_BYTES : (index + 1) * PACKET_BYTES]
            if self._suspicious(packet):
                return ()
        return [self._device.decode(stamp, data, index) for index, stamp in enumerate(stamps)]

    def _with_retries(self, transfer: Callable[[], Stamped]) -> Stamped:
        for attempt in range(RETRIES):
            try:
                return transfer()
            except OSError:
                self.counters.bus_errors += 1
                self._sleep(RETRY_PAUSE * 2**attempt)
        return transfer()

    def _suspicious(self, packet: bytes) -> bool:
        """Whether this sample cannot be one; starts what sets it right."""
        if packet == self._last_packet:
            self._repeats += 1
            if self._repeats >= self._limit:
                self.counters.frozen += 1
                self._restart(f"frozen: {self._limit} equal samples")
                return True
        else:
            self._last_packet, self._repeats = packet, 1
        if packet[:6] == b"\0\0\0\0\0\0":  # free fall to the last bit: a chip asleep
            self._check()
            return not self.running
        return False

    def _check(self) -> None:
        self._next_check = self._monotonic() + round(CHECK_PERIOD * 1e9)
        if not self._device.is_configured():
            self.counters.lost_settings += 1
            self._restart("the chip has lost its settings; brown-out?")

    def _notice_silence(self) -> None:
        if self._monotonic() - self._silent_since < SILENCE * 1e9:
            return
        self._check()
        if self.running:
            self.counters.silences += 1
            self._restart(f"no sample for {SILENCE} s")

    def _failed(self, error: OSError) -> None:
        self.counters.bus_errors += 1
        self.counters.failed_polls += 1
        self._failures += 1
        self.last_error = f"bus error: {error}"
        if self._failures >= FAILED_POLLS:
            self._restart(self.last_error)

    def _resynchronise(self, reason: str) -> None:
        self.last_error = reason
        self._with_retries(self._device.reset_fifo)
        self._torn = False
        self.sample_clock.restart()
        self.counters.fifo_resynchronisations += 1

    def _restart(self, reason: str) -> None:
        """Give the chip up for now; the next polls set it up again."""
        self.last_error = reason
        self.counters.reinitialisations += 1
        self.phase = Phase.WAITING
        self._next = self._monotonic()

    def _recover(self) -> None:
        if self.phase is Phase.STOPPED or self._monotonic() < self._next:
            return
        try:
            if self.phase is Phase.WAITING:
                self._device.reset()
                self.phase = Phase.RESETTING
                self._next = self._monotonic() + round(RESET_TIME * 1e9)
            else:
                self._device.configure()
                self._run()
        except (OSError, SensorError) as error:
            self.counters.bus_errors += 1
            self.failed_attempts += 1
            self.last_error = f"cannot set the chip up: {error}"
            self.phase = Phase.WAITING
            self._next = self._monotonic() + round(self._wait * 1e9)
            self._wait = min(2.0 * self._wait, LONGEST_WAIT)

    def _run(self) -> None:
        now = self._monotonic()
        self.phase = Phase.RUNNING
        self._failures = self._repeats = self.failed_attempts = 0
        self._last_packet = b""
        self._torn = False
        self._wait = FIRST_WAIT
        self._next_check = now + round(CHECK_PERIOD * 1e9)
        self._silent_since = now
        self.sample_clock.restart()

    def stop(self) -> None:
        """Release the bus."""
        self.phase = Phase.STOPPED
        self._device.close()
