"""I2C transfers answered from simulated registers, as an adapter and its chip would."""

from __future__ import annotations

import errno
from collections.abc import Sequence
from dataclasses import dataclass

from twbr_estimation.sensors.i2c import Registers

READS = 0x0001
"""Flag of a message that reads."""


@dataclass
class Message:
    """One message of a transfer."""

    address: int
    flags: int
    length: int
    data: bytes = b""
    """What is written."""


@dataclass
class Adapter:
    """An adapter with one chip; it can be made to fail."""

    chip: Registers
    address: int = 0x68
    half: int = 0
    """Transfers to come that end after their first message."""
    error: int = 0
    """Number of the error that every transfer ends with; 0 for none."""
    transfers: int = 0

    def transfer(self, messages: Sequence[Message]) -> tuple[int, bytes]:
        """Return the messages done, or minus an error's number, and the bytes read."""
        self.transfers += 1
        if self.error:
            return -self.error, b""
        if any(message.address != self.address for message in messages):
            return -errno.ENXIO, b""
        if self.half and len(messages) == 2:
            self.half -= 1
            return 1, b""
        try:
            return len(messages), self._answer(messages)
        except OSError as error:
            return -(error.errno or errno.EIO), b""

    def _answer(self, messages: Sequence[Message]) -> bytes:
        read, register = b"", 0
        for message in messages:
            if message.flags & READS:
                read += self.chip.read(register, message.length)
                continue
            register = message.data[0]
            for offset, value in enumerate(message.data[1:]):
                self.chip.write(register + offset, value)
        return read
