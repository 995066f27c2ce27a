"""The bus through the real `smbus2`, with the kernel's answers replaced."""

from __future__ import annotations

import ctypes
import errno
import os
from pathlib import Path
from typing import Any

import pytest

smbus2 = pytest.importorskip("smbus2", reason="needs the extra `hardware`")

from twbr_estimation.errors import SensorError  # noqa: E402
from twbr_estimation.sensors import i2c  # noqa: E402
from twbr_estimation.sensors.i2c import FUNC_I2C, I2C_RDWR, I2C_SLAVE, I2cRegisters  # noqa: E402
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050  # noqa: E402

I2C_FUNCS = 0x0705


class Kernel:
    """Answers the ioctls of i2c-dev from a simulated chip."""

    def __init__(self, chip: SimulatedMpu6050) -> None:
        self.chip = chip
        self.funcs = FUNC_I2C
        self.bound = False
        self.transferred: int | None = None
        """Messages transferred; None for all."""
        self.longest = 10**6
        """Bytes that the adapter reads at once."""

    def ioctl(self, descriptor: int, request: int, argument: Any) -> int:
        os.fstat(descriptor)
        if request == I2C_FUNCS:
            argument.value = self.funcs
            return 0
        if request == I2C_SLAVE:
            if self.bound:
                raise OSError(errno.EBUSY, "Device or resource busy")
            return 0
        assert request == I2C_RDWR
        return self._transfer([argument.msgs[index] for index in range(argument.nmsgs)])

    def _transfer(self, messages: list[Any]) -> int:
        done = len(messages) if self.transferred is None else self.transferred
        if done == 2:
            first, second = messages
            assert second.addr == 0x68
            if second.len > self.longest:
                raise OSError(errno.EOPNOTSUPP, "Operation not supported")
            data = self.chip.read(bytes(first)[0], second.len)
            ctypes.memmove(second.buf, data, len(data))
        elif done == len(messages) == 1:
            self.chip.write(*bytes(messages[0]))
        return done


@pytest.fixture
def kernel(clock: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Kernel:
    made = Kernel(SimulatedMpu6050(clock))
    device = tmp_path / "i2c"
    device.touch()
    opened = os.open
    monkeypatch.setattr(smbus2.smbus2, "ioctl", made.ioctl)
    monkeypatch.setattr(i2c.fcntl, "ioctl", made.ioctl)
    monkeypatch.setattr(smbus2.smbus2.os, "open", lambda path, flags: opened(device, flags))
    return made


def test_registers_are_read_and_written(kernel: Kernel) -> None:
    bus = I2cRegisters(1, 0x68)
    assert bus.read(0x75, 1) == b"\x68"
    bus.write(0x1B, 0x18)
    assert bus.read(0x1B, 1) == b"\x18"
    assert bus.read(0x1A, 3) == b"\x00\x18\x00"
    bus.close()


def test_an_adapter_that_transfers_half_is_a_broken_transfer(kernel: Kernel) -> None:
    bus = I2cRegisters(1, 0x68)
    assert bus.read(0x75, 1) == b"\x68"
    kernel.transferred = 1
    with pytest.raises(OSError, match="1 of 2 messages"):
        bus.read(0x75, 1)
    kernel.transferred = 0
    assert bus.read(0x75, 1) == b"\x00", "never the answer of the transfer before"


def test_an_adapter_without_plain_i2c_is_named_as_what_it_is(kernel: Kernel) -> None:
    kernel.funcs = 0x0FFF0000
    with pytest.raises(SensorError, match=r"/dev/i2c-3: this adapter does SMBus commands only"):
        I2cRegisters(3, 0x68)


def test_an_adapter_of_four_bytes_is_named_as_what_it_is(kernel: Kernel) -> None:
    kernel.longest = 4
    bus = I2cRegisters(1, 0x68)
    assert len(bus.read(0x3B, 4)) == 4
    with pytest.raises(OSError, match="the adapter does not read 14 bytes at once") as caught:
        bus.read(0x3B, 14)
    assert caught.value.errno == errno.EOPNOTSUPP, "which the reader of the FIFO adapts to"


def test_a_chip_that_a_kernel_driver_holds_is_left_alone(kernel: Kernel) -> None:
    kernel.bound = True
    with pytest.raises(SensorError, match=r"/dev/i2c-1: a kernel driver holds the chip at 0x68"):
        I2cRegisters(1, 0x68)
