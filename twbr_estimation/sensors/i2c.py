"""Registers of one I2C device, behind an interface that a simulated chip shares."""

from __future__ import annotations

from typing import Any, Protocol

from ..errors import SensorError


class Registers(Protocol):
    """The registers of one device. Transfers that fail raise `OSError`."""

    def read(self, register: int, length: int) -> bytes:
        """Read `length` bytes in one transfer, from `register` upwards."""

    def write(self, register: int, value: int) -> None:
        """Write one byte."""

    def close(self) -> None:
        """Release the bus."""


class I2cRegisters:
    """A device on `/dev/i2c-N`, through `smbus2`.

    Plain I2C messages are used instead of SMBus block reads, which end at 32 bytes.
    """

    def __init__(self, bus: int, address: int) -> None:
        """Open the bus.

        Raises:
            SensorError: no `smbus2`, no such bus, or no permission to use it.
        """
        try:
            import smbus2
        except ImportError:
            raise SensorError(
                "smbus2 is not installed; install it with pip or as python3-smbus2"
            ) from None
        try:
            self._bus: Any = smbus2.SMBus(bus)
        except OSError as error:
            raise SensorError(
                f"/dev/i2c-{bus}: {error.strerror}; is I2C enabled, and is the user in group i2c?"
            ) from None
        self._address = address
        self._message = smbus2.i2c_msg
        self._reads: dict[tuple[int, int], tuple[Any, Any]] = {}

    def read(self, register: int, length: int) -> bytes:
        """Read `length` bytes in one transfer, from `register` upwards."""
        messages = self._reads.get((register, length))
        if messages is None:
            messages = (
                self._message.write(self._address, [register]),
                self._message.read(self._address, length),
            )
            self._reads[register, length] = messages
        self._bus.i2c_rdwr(*messages)
        return bytes(messages[1])

    def write(self, register: int, value: int) -> None:
        """Write one byte."""
        self._bus.i2c_rdwr(self._message.write(self._address, [register, value]))

    def close(self) -> None:
        """Release the bus."""
        self._bus.close()
