"""Settings of an MPU6050: what a user chooses, with limits and units."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from ..errors import ConfigurationError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..robot import Calibration
from ..samples import STANDARD_GRAVITY
from .chip_models import MPU6050, ChipModel
from .mpu6050_registers import ACCEL_RANGES_G, GYRO_RANGES_DEG, RAW_FULL_SCALE, internal_rate


class Reading(str, Enum):
    """Way in which samples are fetched."""

    BURST = "burst"
    """One 14-byte transfer at each tick: the newest sample."""
    FIFO = "fifo"
    """Everything the chip has sampled since the last tick, stamped by its own clock."""


@dataclass(frozen=True, slots=True)
class Mpu6050Settings:
    """Set-up of the chip and of its reading.

    Ranges of +-1000 deg/s and +-8 g are the defaults, because a fall or a push clips smaller ones
    and costs the estimate far more than the finer steps are worth. Everything else is as in
    Laddach 2022, whose ranges of +-250 deg/s and +-2 g are in `mpu6050_laddach2022.yaml`.

    Raises:
        ConfigurationError: a value the chip does not have.
    """

    bus: Annotated[int, Bounds(0, 255, "", "Number N of /dev/i2c-N.")] = 1
    address: Annotated[int, Bounds(0x68, 0x69, "", "I2C address: 104, or 105 with AD0 high.")] = (
        0x68
    )
    gyro_range_deg: Annotated[
        int, Bounds(250, 2000, "deg/s", "Full scale of the gyro: 250, 500, 1000 or 2000.")
    ] = 1000
    accel_range_g: Annotated[
        int, Bounds(2, 16, "g", "Full scale of the accelerometer: 2, 4, 8 or 16.")
    ] = 8
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
    reading: Annotated[
        Reading,
        Meaning(
            "How samples are fetched: `burst` reads the newest at each tick, `fifo` reads all."
        ),
    ] = Reading.BURST
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
        self.require_fifo(MPU6050)

    @property
    def sample_rate(self) -> float:
        """Rate at which the chip samples [Hz]."""
        return internal_rate(self.dlpf_config) / (1 + self.sample_rate_divider)

    @property
    def delivered_rate(self) -> float:
        """Rate of the samples that reach the user [Hz]."""
        return self.poll_rate if self.reading is Reading.BURST else self.sample_rate

    @property
    def gyro_range(self) -> float:
        """Full scale of the gyro [rad/s]."""
        return math.radians(self.gyro_range_deg)

    @property
    def accel_range(self) -> float:
        """Full scale of the accelerometer [m/s^2]."""
        return self.accel_range_g * STANDARD_GRAVITY

    @property
    def gyro_scale(self) -> float:
        """Angular rate of one least significant bit [rad/s]."""
        return self.gyro_range / RAW_FULL_SCALE

    @property
    def accel_scale(self) -> float:
        """Specific force of one least significant bit [m/s^2]."""
        return self.accel_range / RAW_FULL_SCALE

    def require_fifo(self, model: ChipModel) -> None:
        """Check that the chip's FIFO holds the samples between two polls.

        Raises:
            ConfigurationError: it is read too slowly.
        """
        samples, room = self.sample_rate / self.poll_rate, model.fifo_packets
        if self.reading is Reading.FIFO and samples > room:
            raise ConfigurationError(
                f"poll_rate: {self.poll_rate:g} Hz is too slow; at {self.sample_rate:g} Hz the "
                f"{room} samples of the FIFO ({model.name}) need more than "
                f"{self.sample_rate / room:.0f} Hz"
            )
