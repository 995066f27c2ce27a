"""The MPU6050 and its relatives: identity, set-up, bursts and FIFO, one transfer or a few each."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from struct import Struct
from typing import NamedTuple

from ..errors import SensorError
from .chip_models import MPU6050, WHO_AM_I, ChipModel, model_of
from .i2c import Registers
from .mpu6050_registers import (
    ACCEL_RANGES_G,
    FIFO_OVERFLOW_FLAG,
    GYRO_RANGES_DEG,
    PACKET_BYTES,
    PWR_MGMT_1_GYRO_CLOCK,
    PWR_MGMT_1_RESET,
    RAW_FULL_SCALE,
    RESET_TIME,
    USER_CTRL_FIFO_EN,
    USER_CTRL_FIFO_RESET,
    Register,
    internal_rate,
)
from .mpu6050_settings import Mpu6050Settings, Reading

__all__ = [
    "FIFO_BYTES",
    "PACKET_BYTES",
    "RAW_FULL_SCALE",
    "RESET_TIME",
    "WHO_AM_I",
    "ImuReading",
    "Mpu6050",
    "Mpu6050Settings",
    "Reading",
    "Register",
    "Words",
    "internal_rate",
    "temperature_of",
]

FIFO_BYTES = MPU6050.fifo_bytes
"""Capacity of the MPU6050's FIFO; relatives differ, see `chip_models`."""
Words = tuple[int, int, int, int, int, int, int]
"""One packet: accelerometer x, y, z, temperature, gyro x, y, z, signed counts."""

_PACKET = Struct(">7h")


class ImuReading(NamedTuple):
    """One sample of the chip in SI units, in the sensor's axes."""

    stamp: int
    """When it was sampled [ns]."""
    gyro_x: float
    gyro_y: float
    gyro_z: float
    accel_x: float
    accel_y: float
    accel_z: float
    temperature: float
    """Temperature of the die [degC]."""


class Mpu6050:
    """One chip: every method is one or a few transfers and raises `OSError` if one fails."""

    def __init__(self, registers: Registers, settings: Mpu6050Settings) -> None:
        self.settings = settings
        self.model: ChipModel
        """Model of the chip; set by `identify`."""
        self._registers = registers
        self._gyro_scale = settings.gyro_scale
        self._accel_scale = settings.accel_scale
        self._take_model(MPU6050)

    def _take_model(self, model: ChipModel) -> None:
        self.model = model
        self._degrees_per_count = model.degrees_per_count
        self._degrees_at_zero = model.degrees_at_zero

    def _read(self, register: int, length: int) -> bytes:
        """Read that many bytes; fewer are a broken transfer."""
        data = self._registers.read(register, length)
        if len(data) != length:
            raise OSError(errno.EIO, f"{len(data)} of {length} bytes came")
        return data

    def identify(self) -> str | None:
        """Find out which chip this is; None for an MPU6050, else a remark about what answered.

        Raises:
            OSError: no transfer succeeds.
            SensorError: the answer is that of an empty bus, or the settings do not fit the chip.
        """
        identity = self._read(Register.WHO_AM_I, 1)[0]
        if identity in (0x00, 0xFF):
            raise SensorError(f"WHO_AM_I: 0x{identity:02x}, which no chip of this family answers")
        self._take_model(model_of(identity))
        self.settings.require_fifo(self.model)
        if identity == WHO_AM_I:
            return None
        use = (
            f"used as such: {self.model.difference}"
            if self.model.known
            else "tried as an MPU6050, but its temperature scale and filters may differ, and it is "
            "refused where a register does not keep what is written"
        )
        return f"WHO_AM_I: 0x{identity:02x} instead of 0x{WHO_AM_I:02x}, {self.model.name}; {use}"

    def reset(self) -> None:
        """Begin a reset; the chip can be set up `RESET_TIME` later."""
        self._registers.write(Register.PWR_MGMT_1, PWR_MGMT_1_RESET)

    def configure(self) -> None:
        """Wake the chip, write the settings and read them back.

        Raises:
            SensorError: a register does not keep what was written.
        """
        for register, value in self._set_up().items():
            self._registers.write(register, value)
        for register, value in self._set_up().items():
            found = self._read(register, 1)[0]
            if found != value:
                whose = "" if self.model.known else f"; the chip is {self.model.name}"
                raise SensorError(
                    f"{register.name}: reads 0x{found:02x} after 0x{value:02x} was written{whose}"
                )
        if self.settings.reading is Reading.FIFO:
            self.reset_fifo()

    def is_configured(self) -> bool:
        """Whether the chip still has its settings; after a brown-out it has not."""
        expected = self._set_up()
        ranges = 5 if self.model.accel_low_pass else 4
        return all(
            self._read(first, length)
            == bytes(expected[Register(first + offset)] for offset in range(length))
            for first, length in ((Register.SMPLRT_DIV, ranges), (Register.PWR_MGMT_1, 2))
        )

    def _set_up(self) -> dict[Register, int]:
        settings = self.settings
        with_fifo = settings.reading is Reading.FIFO
        values = {
            Register.PWR_MGMT_1: PWR_MGMT_1_GYRO_CLOCK,
            Register.PWR_MGMT_2: 0,
            Register.SMPLRT_DIV: settings.sample_rate_divider,
            Register.CONFIG: settings.dlpf_config,
            Register.GYRO_CONFIG: GYRO_RANGES_DEG.index(settings.gyro_range_deg) << 3,
            Register.ACCEL_CONFIG: ACCEL_RANGES_G.index(settings.accel_range_g) << 3,
        }
        if self.model.accel_low_pass:  # the same cut-offs as the gyro's, to a few hertz
            values[Register.ACCEL_CONFIG_2] = settings.dlpf_config
        values[Register.FIFO_EN] = self.model.fifo_enable if with_fifo else 0
        values[Register.INT_ENABLE] = FIFO_OVERFLOW_FLAG if with_fifo else 0
        return values

    def read_packet(self) -> bytes:
        """Read the newest sample in one burst, so that its words belong together."""
        return self._read(Register.ACCEL_XOUT_H, PACKET_BYTES)

    def fifo_count(self) -> int:
        """Return the bytes in the FIFO; a full FIFO has lost samples."""
        return int.from_bytes(self._read(Register.FIFO_COUNT_H, 2), "big")

    def fifo_overflowed(self) -> bool:
        """Whether the FIFO has lost bytes since the last call or reset."""
        return bool(self._read(Register.INT_STATUS, 1)[0] & FIFO_OVERFLOW_FLAG)

    def read_fifo(self, packets: int) -> bytes:
        """Read whole packets, the oldest first, in one transfer."""
        return self._read(Register.FIFO_R_W, packets * PACKET_BYTES)

    def reset_fifo(self) -> None:
        """Empty the FIFO and start filling it again, beginning with a whole packet."""
        self._registers.write(Register.USER_CTRL, 0)
        self._registers.write(Register.USER_CTRL, USER_CTRL_FIFO_RESET)
        self._registers.write(Register.USER_CTRL, USER_CTRL_FIFO_EN)
        self._read(Register.INT_STATUS, 1)

    def decode(self, stamp: int, data: bytes, packet: int = 0) -> ImuReading:
        """Turn one packet of `data` into SI units."""
        return self.reading(stamp, words_of(data, packet))

    def reading(self, stamp: int, words: Words) -> ImuReading:
        """Turn the words of one packet into SI units."""
        accel, gyro = self._accel_scale, self._gyro_scale
        return ImuReading(
            stamp,
            words[4] * gyro,
            words[5] * gyro,
            words[6] * gyro,
            words[0] * accel,
            words[1] * accel,
            words[2] * accel,
            words[3] * self._degrees_per_count + self._degrees_at_zero,
        )

    def close(self) -> None:
        """Release the bus."""
        self._registers.close()


def words_of(data: bytes, packet: int = 0) -> Words:
    """Return the seven words of one packet of `data`."""
    return _PACKET.unpack_from(data, packet * PACKET_BYTES)


def packets_of(data: bytes) -> Iterator[Words]:
    """Yield the seven words of each packet of `data`."""
    return _PACKET.iter_unpack(data)


def temperature_of(raw: int) -> float:
    """Return the temperature of an MPU6050's die [degC]."""
    return MPU6050.temperature(raw)
