"""Whole packets and their stamps out of an MPU6050's FIFO, whatever happens to it meanwhile."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from ..errors import SensorError
from .chip_models import LARGEST_FIFO
from .mpu6050 import Mpu6050
from .mpu6050_counters import Counters
from .mpu6050_registers import PACKET_BYTES
from .sample_clock import SampleClock

SLOW_TRANSFER = 0.002
"""Duration of reading the FIFO's count beyond which its time is not used [s]."""
TOO_LONG = (errno.EOPNOTSUPP, errno.EINVAL, errno.EMSGSIZE)
"""Errors of adapters for a transfer that is too long for them."""

Result = TypeVar("Result")


class Retry(Protocol):
    """Returns what a transfer gives, tried again a few times if it fails."""

    def __call__(self, transfer: Callable[[], Result]) -> Result:
        """Transfer."""


class OutOfStepError(SensorError):
    """The FIFO does not begin with a whole packet or has lost some; the text gives the reason."""

    def __init__(self, reason: str, overflow: bool = False) -> None:
        super().__init__(reason)
        self.overflow = overflow
        """Whether it ran over."""


class FifoReader:
    """Reads blocks of packets; a block that lost bytes on the way is never returned."""

    def __init__(
        self,
        device: Mpu6050,
        clock: Callable[[], int],
        monotonic: Callable[[], int],
        counters: Counters,
        retry: Retry,
    ) -> None:
        self._device = device
        self._clock, self._monotonic = clock, monotonic
        self._counters, self._retry = counters, retry
        self.sample_clock = SampleClock(1.0 / device.settings.sample_rate)
        """Relation between the chip's clock and the host's."""
        self.transfer_packets = LARGEST_FIFO // PACKET_BYTES
        """Packets that the adapter reads in one transfer; found out when it refuses more."""
        self._torn = False
        self._first = True

    def restart(self) -> None:
        """Forget the past of a chip that was set up again."""
        self._torn, self._first = False, True
        self.sample_clock.restart()

    def resynchronise(self) -> None:
        """Empty the FIFO, so that it begins with a whole packet."""
        self._retry(self._device.reset_fifo)
        self._torn = False
        self.sample_clock.restart()
        self._counters.fifo_resynchronisations += 1

    def read(self) -> tuple[Sequence[int], bytes]:
        """Return the stamps [ns] and the bytes of the packets that are new.

        Raises:
            OutOfStepError: packets were lost or torn; `resynchronise` is needed.
            OSError: a transfer failed, also when tried again.
        """
        first, self._first = self._first, False
        try:
            return self._whole_packets()
        except OutOfStepError as error:
            if not first:
                self._counters.fifo_overflows += error.overflow
                raise
        self._retry(self._device.reset_fifo)  # filled since the set-up, perhaps for long
        return (), b""

    def _whole_packets(self) -> tuple[Sequence[int], bytes]:
        if self._torn:
            raise OutOfStepError("FIFO emptied after a broken transfer")
        now, count, trusted = self._whole_count()
        packets = count // PACKET_BYTES
        if packets == 0:
            return (), b""
        data = self._packets(packets)
        self._torn = True  # where the next transfer fails, samples are lost that nobody stamped
        _require_no_overflow(self._retry(self._device.fifo_overflowed))
        self._torn = False
        stamps = self.sample_clock.stamps(packets, now, trusted)
        self._counters.clock_jumps += self.sample_clock.jumps
        self.sample_clock.jumps = 0
        return stamps, data

    def _whole_count(self) -> tuple[int, int, bool]:
        """Return the time [ns] of a count, the count, and whether the time is reliable."""
        found = self._retry(self._stamped_count)
        _require_no_overflow(found[1] > self._device.model.fifo_bytes - PACKET_BYTES)
        if found[1] % PACKET_BYTES:  # the chip may be writing a packet just now
            found = self._retry(self._stamped_count)
            if remainder := found[1] % PACKET_BYTES:
                raise OutOfStepError(f"FIFO out of step: {remainder} bytes beside whole packets")
        return found

    def _stamped_count(self) -> tuple[int, int, bool]:
        stamp, begin = self._clock(), self._monotonic()
        count = self._device.fifo_count()
        if count > LARGEST_FIFO:
            raise OSError(errno.EIO, f"{count} bytes in a FIFO")
        return stamp, count, self._monotonic() - begin < SLOW_TRANSFER * 1e9

    def _packets(self, packets: int) -> bytes:
        # Not retried: a transfer that breaks may have taken bytes out and torn a packet.
        self._torn = True
        blocks = []
        while packets:
            size = min(packets, self.transfer_packets)
            try:
                blocks.append(self._device.read_fifo(size))
            except OSError as error:
                if error.errno not in TOO_LONG or size == 1:
                    raise
                self.transfer_packets = size // 2
                continue
            packets -= size
        self._torn = False
        return b"".join(blocks)


def _require_no_overflow(overflowed: bool) -> None:
    if overflowed:
        raise OutOfStepError("FIFO overflow: samples lost, reading too slowly", overflow=True)
