"""The MPU6050: registers, ranges, set-up, bursts and FIFO.

Register numbers and their meaning follow InvenSense's RM-MPU-6000A, revision 4.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, IntEnum
from struct import Struct
from typing import Annotated, NamedTuple

from ..errors import ConfigurationError, SensorError
from ..parameters.bounds import Bounds, require_bounds
from ..robot import Calibration
from ..samples import STANDARD_GRAVITY
from .i2c import Registers

WHO_AM_I = 0x68
"""Identity of the MPU6000 and MPU6050, whatever the level of AD0."""
RELATIVES = {
    0x70: "MPU6500",
    0x71: "MPU9250",
    0x72: "an MPU6050 copy",
    0x73: "MPU9255",
    0x75: "an MPU9250 copy",
    0x98: "an MPU6050 copy (ICM20689 family)",
}
"""Chips sold on the same boards, by what they answer to WHO_AM_I."""

PACKET_BYTES = 14
"""Accelerometer, temperature and gyro, seven big-endian 16-bit words."""
FIFO_BYTES = 1024
FIFO_PACKETS = FIFO_BYTES // PACKET_BYTES
RESET_TIME = 0.1
"""Time from the reset bit to a chip that can be set up [s]."""
RAW_FULL_SCALE = 32768
GYRO_RANGES_DEG = (250, 500, 1000, 2000)
ACCEL_RANGES_G = (2, 4, 8, 16)

_PACKET = Struct(">7h")


class Register(IntEnum):
    """Register addresses."""

    SMPLRT_DIV = 0x19
    CONFIG = 0x1A
    GYRO_CONFIG = 0x1B
    ACCEL_CONFIG = 0x1C
    FIFO_EN = 0x23
    INT_ENABLE = 0x38
    INT_STATUS = 0x3A
    ACCEL_XOUT_H = 0x3B
    USER_CTRL = 0x6A
    PWR_MGMT_1 = 0x6B
    PWR_MGMT_2 = 0x6C
    FIFO_COUNT_H = 0x72
    FIFO_R_W = 0x74
    WHO_AM_I = 0x75


FIFO_EN_ALL = 0xF8
"""Temperature, three gyro axes and accelerometer go to the FIFO, in register order."""
USER_CTRL_FIFO_EN = 0x40
USER_CTRL_FIFO_RESET = 0x04
PWR_MGMT_1_RESET = 0x80
PWR_MGMT_1_SLEEP = 0x40
PWR_MGMT_1_GYRO_CLOCK = 0x01
"""Awake, clock from the gyro's x axis, steadier than the internal oscillator."""


class Reading(str, Enum):
    """How samples are fetched."""

    BURST = "burst"
    """One 14-byte transfer at each tick: the newest sample."""
    FIFO = "fifo"
    """Everything the chip has sampled since the last tick, stamped by its own clock."""


@dataclass(frozen=True, slots=True)
class Mpu6050Settings:
    """Set-up of the chip and of its reading. The defaults are those of Laddach 2022.

    Raises:
        ConfigurationError: a value the chip does not have.
    """

    bus: Annotated[int, Bounds(0, 255, "", "Number N of /dev/i2c-N.")] = 1
    address: Annotated[int, Bounds(0x68, 0x69, "", "I2C address: 104, or 105 with AD0 high.")] = (
        WHO_AM_I
    )
    gyro_range_deg: Annotated[
        int, Bounds(250, 2000, "deg/s", "Full scale of the gyro: 250, 500, 1000 or 2000.")
    ] = 250
    accel_range_g: Annotated[
        int, Bounds(2, 16, "g", "Full scale of the accelerometer: 2, 4, 8 or 16.")
    ] = 2
    dlpf_config: Annotated[
        int,
        Bounds(0, 6, "", "Digital low-pass filter DLPF_CFG: 0 none (256 Hz), 1 188 Hz, 2 98 Hz, "
               "3 42 Hz, 4 20 Hz, 5 10 Hz, 6 5 Hz. Larger is smoother and later."),
    ] = 0  # fmt: skip
    sample_rate_divider: Annotated[
        int,
        Bounds(0, 255, "", "SMPLRT_DIV: the chip samples at 8 kHz (dlpf_config 0) or 1 kHz "
               "divided by 1 + this."),
    ] = 7  # fmt: skip
    reading: Reading = Reading.BURST
    """How samples are fetched: `burst` reads the newest at each tick, `fifo` reads all."""
    poll_rate: Annotated[
        float, Bounds(1.0, 2000.0, "Hz", "Ticks; with `burst` this is the rate of the samples.")
    ] = 500.0
    gyro_stddev: Annotated[
        float, Bounds(0.0, 10.0, "rad/s", "Standard deviation published; 0 means unknown.")
    ] = Calibration().gyro_noise
    accel_stddev: Annotated[
        float, Bounds(0.0, 100.0, "m/s^2", "Standard deviation published; 0 means unknown.")
    ] = Calibration().accel_noise
    frozen_samples: Annotated[
        int, Bounds(2, 100000, "", "Equal samples in a row that mean a frozen sensor.")
    ] = 100

    def __post_init__(self) -> None:
        require_bounds(self)
        object.__setattr__(self, "reading", Reading(self.reading))
        for name, allowed in (
            ("gyro_range_deg", GYRO_RANGES_DEG),
            ("accel_range_g", ACCEL_RANGES_G),
        ):
            if getattr(self, name) not in allowed:
                raise ConfigurationError(f"{name}: {getattr(self, name)} is not one of {allowed}")
        if self.reading is Reading.BURST and self.poll_rate > self.sample_rate:
            raise ConfigurationError(
                f"poll_rate: {self.poll_rate:g} Hz is above the chip's {self.sample_rate:g} Hz; "
                "samples would be read twice"
            )
        if self.reading is Reading.FIFO and self.sample_rate / self.poll_rate > FIFO_PACKETS:
            raise ConfigurationError(
                f"poll_rate: {self.poll_rate:g} Hz is too slow; at {self.sample_rate:g} Hz the "
                f"{FIFO_PACKETS} samples of the FIFO need more than "
                f"{self.sample_rate / FIFO_PACKETS:.0f} Hz"
            )

    @property
    def sample_rate(self) -> float:
        """Rate at which the chip samples [Hz]."""
        return internal_rate(self.dlpf_config) / (1 + self.sample_rate_divider)

    @property
    def delivered_rate(self) -> float:
        """Rate of the samples that reach the user [Hz]."""
        return self.poll_rate if self.reading is Reading.BURST else self.sample_rate

    @property
    def gyro_scale(self) -> float:
        """Angular rate of one least significant bit [rad/s]."""
        return math.radians(self.gyro_range_deg) / RAW_FULL_SCALE

    @property
    def accel_scale(self) -> float:
        """Specific force of one least significant bit [m/s^2]."""
        return self.accel_range_g * STANDARD_GRAVITY / RAW_FULL_SCALE


def internal_rate(dlpf_config: int) -> float:
    """Return the gyro's output rate before the divider [Hz]."""
    return 8000.0 if dlpf_config in (0, 7) else 1000.0


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
        self._registers = registers
        self._gyro_scale = settings.gyro_scale
        self._accel_scale = settings.accel_scale

    def identify(self) -> str | None:
        """Return None for an MPU6050, or a warning that says what answered instead.

        Raises:
            SensorError: the answer is that of an empty bus.
        """
        identity = self._registers.read(Register.WHO_AM_I, 1)[0]
        if identity in (0x00, 0xFF):
            raise SensorError(f"WHO_AM_I: 0x{identity:02x}, which no chip of this family answers")
        if identity == WHO_AM_I:
            return None
        name = RELATIVES.get(identity, "an unknown chip")
        return (
            f"WHO_AM_I: 0x{identity:02x} instead of 0x{WHO_AM_I:02x}, {name}; using it as an "
            "MPU6050, but its temperature scale and filters may differ"
        )

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
            found = self._registers.read(register, 1)[0]
            if found != value:
                raise SensorError(
                    f"{register.name}: reads 0x{found:02x} after 0x{value:02x} was written"
                )
        if self.settings.reading is Reading.FIFO:
            self.reset_fifo()

    def is_configured(self) -> bool:
        """Whether the chip still has its settings; after a brown-out it has not."""
        expected = self._set_up()
        return all(
            self._registers.read(first, length)
            == bytes(expected[Register(first + offset)] for offset in range(length))
            for first, length in ((Register.SMPLRT_DIV, 4), (Register.PWR_MGMT_1, 2))
        )

    def _set_up(self) -> dict[Register, int]:
        settings = self.settings
        with_fifo = settings.reading is Reading.FIFO
        return {
            Register.PWR_MGMT_1: PWR_MGMT_1_GYRO_CLOCK,
            Register.PWR_MGMT_2: 0,
            Register.SMPLRT_DIV: settings.sample_rate_divider,
            Register.CONFIG: settings.dlpf_config,
            Register.GYRO_CONFIG: GYRO_RANGES_DEG.index(settings.gyro_range_deg) << 3,
            Register.ACCEL_CONFIG: ACCEL_RANGES_G.index(settings.accel_range_g) << 3,
            Register.FIFO_EN: FIFO_EN_ALL if with_fifo else 0,
        }

    def read_packet(self) -> bytes:
        """Read the newest sample in one burst, so that its words belong together."""
        return self._registers.read(Register.ACCEL_XOUT_H, PACKET_BYTES)

    def fifo_count(self) -> int:
        """Return the bytes in the FIFO; a full FIFO has lost samples."""
        return int.from_bytes(self._registers.read(Register.FIFO_COUNT_H, 2), "big")

    def read_fifo(self, packets: int) -> bytes:
        """Read whole packets, the oldest first, in one transfer."""
        return self._registers.read(Register.FIFO_R_W, packets * PACKET_BYTES)

    def reset_fifo(self) -> None:
        """Empty the FIFO and start filling it anew, beginning with a whole packet."""
        self._registers.write(Register.USER_CTRL, 0)
        self._registers.write(Register.USER_CTRL, USER_CTRL_FIFO_RESET)
        self._registers.write(Register.USER_CTRL, USER_CTRL_FIFO_EN)

    def decode(self, stamp: int, data: bytes, packet: int = 0) -> ImuReading:
        """Turn one packet of `data` into SI units."""
        words = _PACKET.unpack_from(data, packet * PACKET_BYTES)
        accel, gyro = self._accel_scale, self._gyro_scale
        return ImuReading(
            stamp,
            words[4] * gyro,
            words[5] * gyro,
            words[6] * gyro,
            words[0] * accel,
            words[1] * accel,
            words[2] * accel,
            temperature_of(words[3]),
        )

    def close(self) -> None:
        """Release the bus."""
        self._registers.close()


def temperature_of(raw: int) -> float:
    """Return the die's temperature [degC]."""
    return raw / 340.0 + 36.53
