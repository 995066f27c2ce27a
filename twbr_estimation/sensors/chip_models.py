"""The chips sold on MPU6050 boards, and in what they differ.

They share ranges, packets and most registers. WHO_AM_I gives the model; sizes of the FIFO and
temperature formulas are those of the data sheets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .mpu6050_registers import FIFO_EN_ALL, FIFO_EN_TWO_BITS, PACKET_BYTES

WHO_AM_I = 0x68
"""Identity of the MPU6000 and MPU6050, whatever the level of AD0."""
LARGEST_FIFO = 4096
"""Bytes in the largest FIFO of the family; a count above it is a disturbed transfer."""


@dataclass(frozen=True, slots=True)
class ChipModel:
    """Properties of one chip that the driver needs."""

    name: str
    fifo_bytes: int = 512
    """Capacity of the FIFO, with the settings that this driver writes."""
    degrees_per_count: float = 1.0 / 333.87
    """Slope of the temperature [degC]."""
    degrees_at_zero: float = 21.0
    """Temperature where the word is 0 [degC]."""
    accel_low_pass: bool = True
    """Whether the accelerometer's low-pass has a separate register, ACCEL_CONFIG_2."""
    fifo_enable: int = FIFO_EN_ALL
    """Bits of FIFO_EN that put whole packets into the FIFO."""

    @property
    def known(self) -> bool:
        """Whether the driver has this chip's data."""
        return self in MODELS.values()

    @property
    def difference(self) -> str:
        """In what the chip differs from an MPU6050."""
        words = [f"a FIFO of {self.fifo_bytes} bytes instead of {MPU6050.fifo_bytes}"]
        if self.degrees_at_zero != MPU6050.degrees_at_zero:
            words.append(
                f"{1.0 / self.degrees_per_count:.1f} counts/degC from {self.degrees_at_zero:g} degC"
            )
        if self.accel_low_pass:
            words.append("the accelerometer's low-pass in a register of its own")
        return ", ".join(words)

    @property
    def fifo_packets(self) -> int:
        """Whole packets that the FIFO holds."""
        return self.fifo_bytes // PACKET_BYTES

    def temperature(self, raw: int) -> float:
        """Return the die's temperature [degC]."""
        return raw * self.degrees_per_count + self.degrees_at_zero


MPU6050 = ChipModel("MPU6050", 1024, 1.0 / 340.0, 36.53, accel_low_pass=False)
UNKNOWN = ChipModel("an unknown chip", 512, 1.0 / 340.0, 36.53, accel_low_pass=False)
"""Used as an MPU6050 with the smallest FIFO of the family."""


def _icm(name: str, fifo_bytes: int = 512, fifo_enable: int = FIFO_EN_ALL) -> ChipModel:
    return ChipModel(name, fifo_bytes, 1.0 / 326.8, 25.0, fifo_enable=fifo_enable)


MODELS = {
    WHO_AM_I: MPU6050,
    0x72: ChipModel("an MPU6050 copy", 512, 1.0 / 340.0, 36.53, accel_low_pass=False),
    0x70: ChipModel("MPU6500"),
    0x71: ChipModel("MPU9250"),
    0x73: ChipModel("MPU9255"),
    0x74: ChipModel("MPU6515"),
    0x75: ChipModel("an MPU9250 copy"),
    0x78: ChipModel("MPU6880"),
    0x11: _icm("ICM20600", 1008, FIFO_EN_TWO_BITS),
    0x12: _icm("ICM20602", 1008, FIFO_EN_TWO_BITS),
    0x19: _icm("MPU6886", 1008, FIFO_EN_TWO_BITS),
    0x98: _icm("ICM20689, or an MPU6050 copy"),
    0xA6: _icm("ICM20609"),
    0xA9: _icm("IAM20680"),
    0xAE: _icm("ICM20608-D"),
    0xAF: _icm("ICM20608-G"),
}
"""Models by what they answer to WHO_AM_I."""
OTHER_MAPS = {
    0x3B: "ICM40609-D",
    0x42: "ICM42605",
    0x44: "ICM42686-P",
    0x46: "ICM42602",
    0x47: "ICM42688-P",
    0x60: "ICM42607-P",
    0x67: "ICM42670-P",
    0x6F: "IIM42652",
    0xDB: "ICM42631",
    0xEA: "ICM20948",
}
"""Chips of the same maker with other registers, by what they answer to WHO_AM_I."""


def model_of(identity: int) -> ChipModel:
    """Return the model of a WHO_AM_I.

    A chip with other registers has its name and the data of `UNKNOWN`, which is also returned
    where the identity is in no table.
    """
    if name := OTHER_MAPS.get(identity):
        return replace(UNKNOWN, name=f"{name}, a chip with other registers")
    return MODELS.get(identity, UNKNOWN)
