"""Registers of one I2C device, behind an interface that a simulated chip shares."""

from __future__ import annotations

import ctypes
import errno
import fcntl
from glob import glob
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


I2C_SLAVE = 0x0703
"""ioctl that claims an address; the kernel refuses it while a kernel driver holds the chip."""
I2C_RDWR = 0x0707
"""ioctl that transfers messages; it returns how many were transferred."""
FUNC_I2C = 0x00000001
"""Bit of an adapter that transfers plain I2C messages."""


class I2cRegisters:
    """A device on `/dev/i2c-N`, through `smbus2`.

    Plain I2C messages are used instead of SMBus block reads, which end at 32 bytes.
    """

    def __init__(self, bus: int, address: int) -> None:
        """Open the bus.

        Raises:
            SensorError: no `smbus2`, no such bus, no permission, an adapter without plain I2C,
                or a kernel driver that holds the chip.
        """
        smbus2 = _smbus2()
        self._name = f"/dev/i2c-{bus}"
        try:
            self._bus: Any = smbus2.SMBus(bus)
        except OSError as error:
            raise SensorError(
                f"{self._name}: {error.strerror}; is I2C enabled, and is the user in group i2c? "
                f"{_available()}"
            ) from None
        self._address = address
        self._message = smbus2.i2c_msg
        self._transaction = smbus2.smbus2.i2c_rdwr_ioctl_data.create
        self._reads: dict[tuple[int, int], tuple[Any, Any]] = {}
        try:
            self._require_plain_i2c()
            self._require_no_driver()
        except SensorError:
            self.close()
            raise

    def _require_plain_i2c(self) -> None:
        if not int(self._bus.funcs) & FUNC_I2C:
            raise SensorError(
                f"{self._name}: this adapter does SMBus commands only (I2C_FUNCS "
                f"0x{int(self._bus.funcs):08x}), not plain I2C transfers; use another bus"
            )

    def _require_no_driver(self) -> None:
        try:
            fcntl.ioctl(self._bus.fd, I2C_SLAVE, self._address)
        except OSError as error:
            if error.errno == errno.EBUSY:
                raise SensorError(
                    f"{self._name}: a kernel driver holds the chip at 0x{self._address:02x}; "
                    "remove its overlay or unbind it (ls /sys/bus/i2c/devices/*/driver)"
                ) from None

    def read(self, register: int, length: int) -> bytes:
        """Read `length` bytes in one transfer, from `register` upwards."""
        found = self._reads.get((register, length))
        if found is None:
            answer = self._message.read(self._address, length)
            found = (
                answer,
                self._transaction(self._message.write(self._address, [register]), answer),
            )
            self._reads[register, length] = found
        answer, transaction = found
        ctypes.memset(answer.buf, 0, length)  # what does not come must not look like the last
        try:
            self._transfer(transaction, 2)
        except OSError as error:
            if error.errno != errno.EOPNOTSUPP:
                raise
            text = f"the adapter does not read {length} bytes at once"
            raise OSError(errno.EOPNOTSUPP, text) from None
        return bytes(answer)

    def write(self, register: int, value: int) -> None:
        """Write one byte."""
        message = self._message.write(self._address, [register, value])
        self._transfer(self._transaction(message), 1)

    def _transfer(self, transaction: Any, messages: int) -> None:
        done = fcntl.ioctl(self._bus.fd, I2C_RDWR, transaction)
        if 0 < done < messages:
            raise OSError(errno.EIO, f"the adapter transferred {done} of {messages} messages")

    def close(self) -> None:
        """Release the bus."""
        self._bus.close()


def _smbus2() -> Any:
    try:
        import smbus2
        import smbus2.smbus2
    except ImportError:
        raise SensorError(
            "smbus2 is not installed; install it with pip or as python3-smbus2"
        ) from None
    return smbus2


def _available() -> str:
    found = sorted(glob("/dev/i2c-*"))
    return f"There are: {', '.join(found)}" if found else "There is no I2C bus"
