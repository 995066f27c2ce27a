"""Guard of late and broken messages before the pairing of an IMU and the wheels beside it."""

from __future__ import annotations

from collections.abc import Mapping

from ..pipeline.pairing import MotorCommand, Pairer, WheelReading
from ..pipeline.physical import BEYOND, imu_fault, wheel_fault
from ..samples import RESTART_GAP, CorrectedSample, Sample
from .stamps import StampGuard, Verdict

StampedSamples = list[tuple[int, CorrectedSample]]
"""Corrected samples with their stamps [ns]."""
UNKNOWN_TIME = 10.0 * RESTART_GAP
"""`dt` [s] of the first sample after a restart: long enough to make filters start afresh."""


def came_instead(waiting: str, refused: Mapping[str, int]) -> str:
    """Return what is waited for, with what came and could not be used.

    Args:
        waiting: What is waited for.
        refused: How many messages were refused, by the reason's name.
    """
    came = ", ".join(f"{count} {name}" for name, count in refused.items() if count)
    if not came:
        return waiting
    beyond = (count for name, count in refused.items() if name.endswith(BEYOND))
    counts = "; counts of the chip? give rad/s and m/s^2" if any(beyond) else ""
    return f"{waiting}; not usable: {came}{counts}"


class GuardedPairing:
    """Takes live readings that are in order and physical; a subclass makes samples of the pairs."""

    def __init__(self, wait: float) -> None:
        """`wait`: how much later [s] than a sample its wheel reading may be stamped."""
        self.imu_guard = StampGuard()
        self.wheel_guard = StampGuard()
        self._pairer = Pairer(wait)

    @property
    def wheels_repeated(self) -> float:
        """For how long the wheels' readings are repeated [s]; 0 where they are not."""
        return self._pairer.repeated

    def flush(self) -> StampedSamples:
        """Return the samples that still wait for a wheel, because nothing more arrives."""
        return self._completed(self._pairer.flush())

    def _completed(self, paired: list[tuple[int, Sample]]) -> StampedSamples:
        """Return the samples made of pairs, each with its stamp."""
        raise NotImplementedError

    def _judged(self, stamp: int, readings: tuple[float, ...]) -> Verdict:
        """Return what to do with gyro and accelerometer readings stamped `stamp` [ns]."""
        if fault := imu_fault(readings):
            return self.imu_guard.skip(fault)
        return self.imu_guard.check(stamp)

    def add_wheels(self, reading: WheelReading) -> StampedSamples:
        """Take a wheel reading; return the samples it completes."""
        if fault := wheel_fault(reading.angle, reading.difference):
            self.wheel_guard.skip(fault)
            return []
        verdict = self.wheel_guard.check(reading.stamp)
        if verdict is Verdict.SKIP:
            return []
        ready: StampedSamples = []
        if verdict is Verdict.RESTART:
            ready = self.flush()
            self._pairer.forget_wheels()
        return ready + self._completed(self._pairer.add_wheels(reading))

    def add_motors(self, command: MotorCommand) -> None:
        """Take a command to the motors."""
        self._pairer.add_motors(command)
