"""A simulated MPU6050 at the level of its registers, with faults on demand."""

from __future__ import annotations

import errno
import random
from collections import deque
from collections.abc import Callable
from struct import Struct

from ..samples import STANDARD_GRAVITY
from .chip_models import MPU6050, WHO_AM_I, ChipModel, model_of
from .motion import Motion, swing
from .mpu6050_registers import (
    ACCEL_RANGES_G,
    DATA_READY_FLAG,
    FIFO_OVERFLOW_FLAG,
    GYRO_RANGES_DEG,
    PACKET_BYTES,
    PWR_MGMT_1_RESET,
    PWR_MGMT_1_SLEEP,
    RAW_FULL_SCALE,
    RESET_TIME,
    USER_CTRL_FIFO_EN,
    USER_CTRL_FIFO_RESET,
    Register,
    internal_rate,
)

FIFO_BYTES = MPU6050.fifo_bytes
"""Largest capacity of a simulated FIFO; that of the model where it is smaller."""
GYRO_NOISE_DEG = 0.05
"""Noise of one gyro sample, RM-MPU-6000A's sibling data sheet, total rms [deg/s]."""
ACCEL_NOISE_G = 0.004
"""Noise of one accelerometer sample: 400 ug/sqrt(Hz) over about 100 Hz [g]."""
DEGREES = 57.29577951308232
_PACKET = Struct(">7h")


class SimulatedMpu6050:
    """Stands where the bus does: same `read`, `write`, `close`, same `OSError`.

    Samples are taken on the chip's own clock, which runs at `clock_rate` times the time
    given by `clock`. Faults: `nack(n)`, `brown_out()`, `frozen`, `identity`; the FIFO
    overflows when it is not read.
    """

    def __init__(
        self,
        clock: Callable[[], int],
        motion: Motion = swing,
        identity: int = WHO_AM_I,
        clock_rate: float = 1.0,
        seed: int = 0,
        reset_time: float = 0.5 * RESET_TIME,
        noise: float = 1.0,
    ) -> None:
        """Power the chip on.

        Args:
            clock: Time [ns].
            motion: Its input; can be replaced at any time.
            identity: What it answers to WHO_AM_I.
            clock_rate: Speed of the chip's clock relative to `clock`.
            seed: Of its noise.
            reset_time: How long it answers nothing after a reset [s].
            noise: Factor on its noise; 0 where the motion holds the noise already.
        """
        self.motion = motion
        self.identity = identity
        self.frozen = False
        """True repeats the same sample for ever."""
        self.transfers = 0
        """Transfers answered so far."""
        self._clock = clock
        self._clock_rate = clock_rate
        self._random = random.Random(seed)
        self._nacks = 0
        self._reset_time = reset_time
        self._noise = noise
        self._ready_at = 0
        self._fifo: deque[int] = deque()
        self._power_on()

    def nack(self, transfers: int) -> None:
        """Leave that many transfers unanswered."""
        self._nacks = transfers

    def brown_out(self) -> None:
        """Lose power for a moment: all settings are gone and the chip sleeps."""
        self._power_on()

    def _power_on(self) -> None:
        self._registers = bytearray(128)
        self._registers[Register.PWR_MGMT_1] = PWR_MGMT_1_SLEEP
        self._fifo.clear()
        self._restart_sampling()

    def _restart_sampling(self) -> None:
        self._origin = self._clock()
        self._taken = 0

    def read(self, register: int, length: int) -> bytes:
        """Answer a read; addresses count up, except at the FIFO."""
        self._answer()
        if register == Register.FIFO_R_W:
            return bytes(self._fifo.popleft() if self._fifo else 0xFF for _ in range(length))
        data = bytes(self._register(register + offset) for offset in range(length))
        if register <= Register.INT_STATUS < register + length:
            self._registers[Register.INT_STATUS] = 0
        return data

    @property
    def model(self) -> ChipModel:
        """Properties by its identity: size of the FIFO and temperature scale."""
        return model_of(self.identity)

    @property
    def _capacity(self) -> int:
        return min(FIFO_BYTES, self.model.fifo_bytes)

    def _register(self, register: int) -> int:
        if register == Register.WHO_AM_I:
            return self.identity
        if register == Register.FIFO_COUNT_H:
            return len(self._fifo) >> 8
        if register == Register.FIFO_COUNT_H + 1:
            return len(self._fifo) & 0xFF
        return self._registers[register]

    def write(self, register: int, value: int) -> None:
        """Take one byte."""
        self._answer()
        if register == Register.PWR_MGMT_1 and value & PWR_MGMT_1_RESET:
            self._power_on()
            self._ready_at = self._clock() + round(self._reset_time * 1e9)
            return
        if register == Register.USER_CTRL:
            if value & USER_CTRL_FIFO_RESET and not value & USER_CTRL_FIFO_EN:
                self._fifo.clear()
            value &= ~USER_CTRL_FIFO_RESET  # the bit clears itself
        self._registers[register] = value
        if register in (Register.SMPLRT_DIV, Register.CONFIG, Register.PWR_MGMT_1):
            self._restart_sampling()

    def close(self) -> None:
        """Release nothing."""

    def _answer(self) -> None:
        if self._nacks > 0:
            self._nacks -= 1
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
        if self._clock() < self._ready_at:
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
        self.transfers += 1
        self._advance()

    def sample_time(self, index: int) -> float:
        """Return when the chip takes its sample of that index, counted since set-up [ns]."""
        return self._origin + index * self._period()

    def _period(self) -> float:
        rate = internal_rate(self._registers[Register.CONFIG] & 7)
        divider = 1 + self._registers[Register.SMPLRT_DIV]
        return 1e9 * divider / rate / self._clock_rate

    def _advance(self) -> None:
        """Take the samples that are due; without the FIFO only the newest matters."""
        if self._registers[Register.PWR_MGMT_1] & PWR_MGMT_1_SLEEP:
            return
        due = int((self._clock() - self._origin) / self._period())
        if due < self._taken:  # the clock was set back
            self._restart_sampling()
            due = 0
        to_fifo = (
            bool(self._registers[Register.USER_CTRL] & USER_CTRL_FIFO_EN)
            and self._registers[Register.FIFO_EN] == self.model.fifo_enable
        )
        if due > self._taken:
            room = self._capacity // PACKET_BYTES + 1
            first = max(self._taken + 1, due - room) if to_fifo else due
            for index in range(first, due + 1):
                self._sample(index, to_fifo)
            self._taken = due

    def _sample(self, index: int, to_fifo: bool) -> None:
        if not (self.frozen and self._taken):
            data = self._packet(self.sample_time(index) * 1e-9)
            first = int(Register.ACCEL_XOUT_H)
            self._registers[first : first + PACKET_BYTES] = data
        self._registers[Register.INT_STATUS] |= DATA_READY_FLAG
        if to_fifo:
            first = int(Register.ACCEL_XOUT_H)
            self._fifo.extend(self._registers[first : first + PACKET_BYTES])
            while len(self._fifo) > self._capacity:  # the oldest bytes go, in mid packet
                self._fifo.popleft()
                self._registers[Register.INT_STATUS] |= FIFO_OVERFLOW_FLAG

    def _packet(self, seconds: float) -> bytes:
        motion = self.motion(seconds)
        gyro_range = GYRO_RANGES_DEG[self._registers[Register.GYRO_CONFIG] >> 3 & 3]
        accel_range = ACCEL_RANGES_G[self._registers[Register.ACCEL_CONFIG] >> 3 & 3]
        accel = (
            self._word(value / STANDARD_GRAVITY, ACCEL_NOISE_G, accel_range)
            for value in (motion.accel_x, motion.accel_y, motion.accel_z)
        )
        gyro = (
            self._word(value * DEGREES, GYRO_NOISE_DEG, gyro_range)
            for value in (motion.gyro_x, motion.gyro_y, motion.gyro_z)
        )
        model = self.model
        temperature = round((motion.temperature - model.degrees_at_zero) / model.degrees_per_count)
        return _PACKET.pack(*accel, temperature, *gyro)

    def _word(self, value: float, noise: float, full_scale: int) -> int:
        raw = round(
            (value + self._noise * self._random.gauss(0.0, noise)) * RAW_FULL_SCALE / full_scale
        )
        return max(-RAW_FULL_SCALE, min(RAW_FULL_SCALE - 1, raw))
