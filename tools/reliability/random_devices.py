"""Devices that answer at random: a chip, a counter, a microcontroller on a serial port."""

from __future__ import annotations

import errno
import math
import random
import time

from twbr_estimation.sensors.encoder import EncoderSettings
from twbr_estimation.sensors.i2c import Registers
from twbr_estimation.sensors.simulated_counter import SimulatedCounter
from twbr_estimation.sensors.simulated_mpu6050 import SimulatedMpu6050
from twbr_estimation.streams.device.binary_frames import DeviceSample, encode_frame

FAULTY = 0.05
"""Share of the answers that are faulty, while faults are on."""
WILD = (0.0, 1e9, -1e30, 3.4e38, math.nan, math.inf, -math.inf)


class RandomRegisters:
    """A chip of which some transfers fail, end early, repeat or hold anything."""

    def __init__(self, chip: SimulatedMpu6050, seed: int) -> None:
        """Stand between this chip and who reads it."""
        self._chip: Registers = chip
        self._random = random.Random(seed)
        self._last = b""
        self.faults = True
        """Whether there are any."""

    def read(self, register: int, length: int) -> bytes:
        """Answer a read."""
        data = self._chip.read(register, length)
        draw, last = self._random, self._last
        self._last = data
        if not self.faults or draw.random() > FAULTY:
            return data
        kind = draw.randrange(6)
        if kind == 0:
            raise OSError(draw.choice((errno.EIO, errno.ENXIO, errno.ETIMEDOUT)), "no answer")
        if kind == 1:
            return data[: draw.randrange(length)]
        if kind == 2 and len(last) == length:
            return last
        if kind == 3:
            return bytes([draw.choice((0x00, 0xFF))]) * length
        return draw.randbytes(length)

    def write(self, register: int, value: int) -> None:
        """Take one byte, or lose it."""
        if self.faults and self._random.random() < FAULTY:
            if self._random.random() < 0.5:
                raise OSError(errno.EIO, "no answer")
            return
        self._chip.write(register, value)

    def close(self) -> None:
        """Release the chip."""
        self._chip.close()


class RandomCounter(SimulatedCounter):
    """A counter of which some reads fail, jump, or hold any number."""

    def __init__(self, clock: object, seed: int) -> None:
        """Count the turns of a wheel that rolls."""
        super().__init__(clock, lambda now: 5.0 * now, EncoderSettings())  # type: ignore[arg-type]
        self._random = random.Random(seed)
        self.faults = True
        """Whether there are any."""

    def read(self) -> int:
        """Return a count."""
        count, draw = super().read(), self._random
        if not self.faults or draw.random() > FAULTY:
            return count
        kind = draw.randrange(3)
        if kind == 0:
            raise OSError(errno.EIO, "no answer")
        return draw.choice((0, -1, 2**16, 2**31, 2**63, draw.randrange(2**16)))


class RandomBoard:
    """A microcontroller whose frames are broken, cut, repeated, or hold wild numbers."""

    def __init__(self, seed: int) -> None:
        """Start at its time 0."""
        self._random = random.Random(seed)
        self._begin = time.monotonic_ns()

    def sound(self) -> bytes:
        """Return a sound frame."""
        ticks = (time.monotonic_ns() - self._begin) // 1000 % 2**32
        return encode_frame(DeviceSample(ticks, (0.1, 0.2, 0.3), (0.0, 0.0, 9.8), (1.0, 2.0)))

    def frame(self) -> bytes:
        """Return a frame, sound or not."""
        draw, data = self._random, self.sound()
        kind = draw.randrange(10)
        if kind == 0:
            return data[: draw.randrange(len(data))]
        if kind == 1:
            return draw.randbytes(draw.randrange(1, 200))
        if kind == 2:
            self._begin = time.monotonic_ns() - 1000 * draw.choice((0, draw.randrange(2**32)))
        if kind == 3:
            return data * 2
        if kind < 6:
            return self._wild()
        return data

    def _wild(self) -> bytes:
        draw = self._random

        def three() -> tuple[float, ...]:
            return tuple(draw.choice((*WILD, draw.gauss(0.0, 10.0))) for _ in range(3))

        sample = DeviceSample(draw.randrange(2**32), three(), three(), three()[: draw.randrange(3)])
        return encode_frame(sample)
