"""Registers of the MPU6050 and its relatives, after InvenSense's RM-MPU-6000A, revision 4.2."""

from __future__ import annotations

from enum import IntEnum

PACKET_BYTES = 14
"""Accelerometer, temperature and gyro, seven big-endian 16-bit words."""
RESET_TIME = 0.1
"""Time from the reset bit to a chip that can be set up [s]."""
RAW_FULL_SCALE = 32768
GYRO_RANGES_DEG = (250, 500, 1000, 2000)
ACCEL_RANGES_G = (2, 4, 8, 16)


class Register(IntEnum):
    """Register addresses."""

    SMPLRT_DIV = 0x19
    CONFIG = 0x1A
    GYRO_CONFIG = 0x1B
    ACCEL_CONFIG = 0x1C
    ACCEL_CONFIG_2 = 0x1D
    """Low-pass of the accelerometer, of the MPU6500 and later; the MPU6050 has none."""
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
FIFO_EN_TWO_BITS = 0x18
"""The same for chips with one bit for the gyro and temperature and one for the accelerometer."""
FIFO_OVERFLOW_FLAG = 0x10
"""Of INT_ENABLE and INT_STATUS; reading INT_STATUS clears it."""
DATA_READY_FLAG = 0x01
USER_CTRL_FIFO_EN = 0x40
USER_CTRL_FIFO_RESET = 0x04
PWR_MGMT_1_RESET = 0x80
PWR_MGMT_1_SLEEP = 0x40
PWR_MGMT_1_GYRO_CLOCK = 0x01
"""Awake, clock from the gyro's x axis, steadier than the internal oscillator."""


def internal_rate(dlpf_config: int) -> float:
    """Return the gyro's output rate before the divider [Hz]."""
    return 8000.0 if dlpf_config in (0, 7) else 1000.0
