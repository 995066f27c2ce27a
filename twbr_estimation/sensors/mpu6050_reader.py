"""Keeps an MPU6050 delivering: retries, sets it up again, and counts what went wrong."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from enum import Enum
from typing import TypeVar

from ..errors import SensorError
from .fifo_reader import FifoReader, OutOfStepError
from .mpu6050 import RESET_TIME, ImuReading, Mpu6050, Reading, Words, packets_of, words_of
from .mpu6050_counters import Counters
from .packet_watch import PacketWatch
from .sample_clock import SampleClock

__all__ = ["Counters", "Mpu6050Reader", "Phase"]

Result = TypeVar("Result")

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


class Phase(Enum):
    """State of the reader."""

    STOPPED = "stopped"
    RUNNING = "running"
    RESETTING = "resetting"
    """The reset bit is set; the chip needs a moment."""
    WAITING = "waiting for the bus"


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
        counters: Counters | None = None,
    ) -> None:
        """Prepare to read; nothing is transferred yet.

        Args:
            device: The chip.
            clock: Stamps samples [ns].
            monotonic: Measures waits [ns].
            sleep: Waits [s].
            counters: Counted on where given, as after the bus was opened again.
        """
        self._device = device
        self._clock = clock
        self._monotonic = monotonic
        self._sleep = sleep
        self.counters = Counters() if counters is None else counters
        self._watch = PacketWatch(device.settings, self.counters)
        self._limit = device.settings.frozen_samples
        self.fifo = FifoReader(device, clock, monotonic, self.counters, self.with_retries)
        """Reader of the FIFO."""
        self._read = self._read_fifo if device.settings.reading is Reading.FIFO else self._burst
        self.phase = Phase.STOPPED
        self.failed_attempts = 0
        """Attempts in a row to set the chip up that failed."""
        self.last_error = ""
        """The latest thing that went wrong, in words."""
        self._failures = 0
        self._wait = FIRST_WAIT
        self._next = self._next_check = 0
        self._silent_since: int | None = None

    def start(self) -> str | None:
        """Identify the chip, reset it and set it up; takes a good `RESET_TIME`.

        Returns:
            A remark about a chip that is not an MPU6050, or None.

        Raises:
            TwbrError: the chip does not answer, does not keep its settings, or is read too
                slowly for its FIFO.
        """
        try:
            remark = self._device.identify()
            self._device.reset()
            self._sleep(RESET_TIME)
            self._device.configure()
        except OSError as error:
            settings = self._device.settings
            raise SensorError(
                f"/dev/i2c-{settings.bus}: nothing answers at 0x{settings.address:02x} ({error})"
            ) from None
        self._run()
        return remark

    @property
    def running(self) -> bool:
        """Whether samples are being delivered."""
        return self.phase is Phase.RUNNING

    @property
    def sample_clock(self) -> SampleClock:
        """Relation between the chip's clock and the host's, with `fifo`."""
        return self.fifo.sample_clock

    @property
    def defect(self) -> str:
        """Which axes stand still although the chip samples, in words; empty for none."""
        return self._watch.stuck.described()

    @property
    def broken(self) -> bool:
        """Whether such an axis is not just at the end of its range."""
        return self._watch.stuck.broken

    def poll(self) -> Sequence[ImuReading]:
        """Return the samples since the last poll: none, one (`burst`) or several (`fifo`)."""
        if not self.running:
            self._recover()
            return ()
        try:
            readings = self._read()
            self._failures = 0
            self._look_after()
        except OSError as error:
            self._failed(error)
            return ()
        return self._accepted(readings)

    def _accepted(self, readings: Sequence[ImuReading]) -> Sequence[ImuReading]:
        """Count the samples, unless they have just led to a new set-up."""
        if not self.running:
            return ()
        self.counters.samples += len(readings)
        return readings

    def _burst(self) -> Sequence[ImuReading]:
        stamp, words = self.with_retries(self._stamped_words)
        if self._watch.jumps(words):
            stamp, words = self._second_look(stamp, words)
        return (self._device.reading(stamp, words),) if self._watch.usable(words) else ()

    def _stamped_words(self) -> tuple[int, Words]:
        stamp = self._clock()
        return stamp, words_of(self._device.read_packet())

    def _second_look(self, stamp: int, words: Words) -> tuple[int, Words]:
        """Read a packet that is far from the last one again; what was torn is so only once."""
        again_at, again = self.with_retries(self._stamped_words)
        if again == words:
            return stamp, words
        self.counters.torn_reads += not self._watch.jumps(again)
        return again_at, again

    def _read_fifo(self) -> Sequence[ImuReading]:
        try:
            stamps, data = self.fifo.read()
        except OutOfStepError as reason:
            self.last_error = str(reason)
            self.fifo.resynchronise()
            return ()
        if not stamps:
            self._notice_silence()
            return ()
        self._silent_since = self._monotonic()
        reading, usable = self._device.reading, self._watch.usable
        packets = zip(stamps, packets_of(data), strict=True)
        return [reading(stamp, words) for stamp, words in packets if usable(words)]

    def with_retries(self, transfer: Callable[[], Result]) -> Result:
        """Return what the transfer gives, tried again a few times if it fails."""
        for attempt in range(RETRIES):
            try:
                return transfer()
            except OSError:
                self.counters.bus_errors += 1
                self._sleep(RETRY_PAUSE * 2**attempt)
        return transfer()

    def _look_after(self) -> None:
        """Set the chip up again where its packets or its settings ask for it."""
        watch = self._watch
        if watch.frozen:
            self.counters.frozen += 1
            self._restart(f"frozen: {self._limit} packets of {watch.invalid or 'equal samples'}")
        elif watch.newly_stuck:
            watch.newly_stuck = False
            self.last_error = self.defect
            if self.broken:  # once: a reset may cure it
                self._restart(self.defect)
        elif watch.invalid or self._monotonic() >= self._next_check:
            self._check(watch.invalid)

    def _check(self, seen: str = "") -> None:
        """Check the chip's settings; `seen` describes what came instead of a sample."""
        self._next_check = self._monotonic() + round(CHECK_PERIOD * 1e9)
        if seen:
            self.last_error = f"packets of {seen} dropped"
        if self._device.is_configured():
            return
        if self._device.is_configured():
            self.counters.torn_reads += 1
            return
        self.counters.lost_settings += 1
        reason = f"the bus reads {seen}" if seen == "ones" else "the chip has lost its settings"
        self._restart(f"{reason}; brown-out?")

    def _notice_silence(self) -> None:
        now = self._monotonic()
        if self._silent_since is None:  # counted from the first poll, which may come late
            self._silent_since = now
        if now - self._silent_since < SILENCE * 1e9:
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
        self._failures = self.failed_attempts = 0
        self._wait = FIRST_WAIT
        self._next_check = now + round(CHECK_PERIOD * 1e9)
        self._silent_since = None
        self._watch.restart()
        self.fifo.restart()

    def stop(self) -> None:
        """Release the bus."""
        self.phase = Phase.STOPPED
        self._device.close()
