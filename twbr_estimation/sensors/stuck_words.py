"""Find axes of an MPU6050 that stand still while the chip goes on sampling.

The noise of a working axis changes its reading from sample to sample. An axis whose word is
the same for a whole window is broken, switched off, or at the end of its range. Where the
settings leave less than a count of noise, as a strong low-pass with a large range does, an
axis is only suspected once something else of the chip has moved.
"""

from __future__ import annotations

import math

from .mpu6050_registers import RAW_FULL_SCALE
from .mpu6050_settings import Mpu6050Settings

Words = tuple[int, ...]

ACCEL, GYRO = (0, 1, 2), (4, 5, 6)
"""Places of the axes in a packet's words."""
BANDWIDTHS = (256.0, 188.0, 98.0, 42.0, 20.0, 10.0, 5.0)
"""Bandwidth of the gyro by DLPF_CFG [Hz]; the accelerometer's is close to it."""
GYRO_NOISE_DEG = 0.005
"""Noise density of the gyro, data sheet [deg/s/sqrt(Hz)]."""
ACCEL_NOISE_G = 400e-6
"""Noise density of the accelerometer, data sheet [g/sqrt(Hz)]."""
NOISY = 0.7
"""Noise of one sample from which on a word cannot stay the same by chance [counts]."""
CORRELATION_TIMES = 50.0
"""Length of a window in units of the inverse bandwidth."""
MOVED = 300
"""Change of another axis of the same sensor that a working axis would share in [counts]."""
MOVED_ACCEL_G = 0.2
"""Change of the accelerometer that no body makes without turning or speeding up [g]."""


class StuckWords:
    """Watches the axes window by window."""

    def __init__(self, settings: Mpu6050Settings) -> None:
        bandwidth = BANDWIDTHS[settings.dlpf_config]
        samples = CORRELATION_TIMES / bandwidth * settings.delivered_rate
        self._window = max(settings.frozen_samples, math.ceil(samples))
        self._settings = settings
        root = math.sqrt(bandwidth)
        counts_per_degree = RAW_FULL_SCALE / settings.gyro_range_deg
        self._counts_per_g = RAW_FULL_SCALE / settings.accel_range_g
        self._noisy = {
            **dict.fromkeys(GYRO, GYRO_NOISE_DEG * root * counts_per_degree >= NOISY),
            **dict.fromkeys(ACCEL, ACCEL_NOISE_G * root * self._counts_per_g >= NOISY),
        }
        self.stuck: dict[int, int] = {}
        """Axes found stuck, and the value they are stuck at [counts]."""
        self._first: Words | None = None
        self._constant: list[int] = []
        self._left = 0

    def restart(self) -> None:
        """Begin a new window; what is stuck stays so until it moves."""
        self._first = None

    def take(self, words: Words) -> tuple[int, ...]:
        """Watch one packet; return the axes that are stuck from now on."""
        first = self._first
        if first is None:
            self._first, self._constant, self._left = words, [*ACCEL, *GYRO], self._window
            return ()
        if self._constant:
            self._constant = [axis for axis in self._constant if words[axis] == first[axis]]
        self._left -= 1
        return self._judged(first, words) if self._left <= 0 else ()

    def _judged(self, first: Words, last: Words) -> tuple[int, ...]:
        found = {
            axis: last[axis]
            for axis in self._constant
            if axis in self.stuck or self._noisy[axis] or _at_full_scale(last[axis])
            or self._moved(axis, first, last)
        }  # fmt: skip
        new = tuple(axis for axis in found if axis not in self.stuck)
        self.stuck = found
        self._first = None
        return new

    def _moved(self, axis: int, first: Words, last: Words) -> bool:
        """Whether something moved that a working axis would have shared in."""
        sensor = GYRO if axis in GYRO else ACCEL
        change = max(abs(last[other] - first[other]) for other in sensor)
        accel = max(abs(last[other] - first[other]) for other in ACCEL)
        return change > MOVED or (sensor is GYRO and accel > MOVED_ACCEL_G * self._counts_per_g)

    @property
    def broken(self) -> bool:
        """Whether an axis is stuck elsewhere than at full scale."""
        return any(not _at_full_scale(value) for value in self.stuck.values())

    def described(self) -> str:
        """Return which axes are stuck and at what, or nothing."""
        parts = []
        for name, sensor in (("gyro", GYRO), ("accelerometer", ACCEL)):
            axes = [axis for axis in sensor if axis in self.stuck]
            for title, full in (("stuck at", False), ("at full scale", True)):
                chosen = [each for each in axes if _at_full_scale(self.stuck[each]) is full]
                if chosen:
                    letters = ", ".join("xyz"[sensor.index(each)] for each in chosen)
                    values = ", ".join(self._in_units(each) for each in chosen)
                    parts.append(f"{name} {letters} {title} {values}")
        return "; ".join(parts)

    def _in_units(self, axis: int) -> str:
        share = self.stuck[axis] / RAW_FULL_SCALE
        if axis in GYRO:
            return f"{share * self._settings.gyro_range_deg:.4g} deg/s"
        return f"{share * self._settings.accel_range_g:.4g} g"


def _at_full_scale(value: int) -> bool:
    return value in (-RAW_FULL_SCALE, RAW_FULL_SCALE - 1)
