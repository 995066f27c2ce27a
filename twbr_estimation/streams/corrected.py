"""From corrected Imu messages back to corrected samples: the other end of the topic.

An Imu message has room for all of a `CorrectedSample` but the time step, the wheels and the
motors: `dt` comes from the stamps, wheels and motors are paired again for filters that read them.
"""

from __future__ import annotations

import math
from collections import deque

from ..messages import tilt_of_quaternion
from ..pipeline.pairing import DEFAULT_WAIT, MotorCommand, Pairer, WheelReading
from ..pipeline.saturation import ACCEL_MARK, GYRO_MARK
from ..samples import CorrectedSample, Sample
from .correction import UNKNOWN_TIME, Stamped
from .messages import ACCEL, ACCEL_COVARIANCE, GYRO, GYRO_COVARIANCE, ORIENTATION_COVARIANCE
from .stamps import StampGuard, Verdict

ROLL_YAW_VARIANCE = math.pi**2
"""Variance [rad^2] of angles about which nothing is known."""
UNREPORTED = -1.0
"""First covariance of a field that a message does not report (REP-145)."""
_PITCH_VARIANCE = ORIENTATION_COVARIANCE + 4


def imu_values(sample: CorrectedSample, tilt: float, variance: float, rate: float) -> list[float]:
    """Return the 37 doubles of an Imu message: a tilt with the sample's readings.

    Args:
        sample: Readings in body axes with their variances.
        tilt: Angle about +y that becomes the orientation [rad].
        variance: Its variance [rad^2].
        rate: Rate about +y [rad/s].
    """
    half, unknown = 0.5 * tilt, ROLL_YAW_VARIANCE
    s = sample
    # fmt: off
    return [
        0.0, math.sin(half), 0.0, math.cos(half),
        unknown, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, unknown,
        s.gyro_x, rate, s.gyro_z,
        s.gyro_variance_x, 0.0, 0.0, 0.0, s.gyro_variance_y, 0.0, 0.0, 0.0, s.gyro_variance_z,
        s.accel_x, s.accel_y, s.accel_z,
        s.accel_variance_x, 0.0, 0.0, 0.0, s.accel_variance_y, 0.0, 0.0, 0.0, s.accel_variance_z,
    ]
    # fmt: on


def has_angle(values: tuple[float, ...]) -> bool:
    """Return whether an Imu message reports an orientation."""
    return values[ORIENTATION_COVARIANCE] != UNREPORTED


class CorrectedStream:
    """Turns the doubles of corrected Imu messages into samples."""

    def __init__(self, wait: float = DEFAULT_WAIT) -> None:
        """`wait`: how much later [s] than a sample its wheel reading may be stamped."""
        self.imu_guard = StampGuard()
        self.wheel_guard = StampGuard()
        self.paired = False
        """Whether samples wait for their wheels and get their motors; else they pass at once."""
        self._pairer = Pairer(wait)
        self._waiting: deque[tuple[int, CorrectedSample]] = deque()
        self._last_stamp: int | None = None

    def add_imu(self, stamp: int, values: tuple[float, ...]) -> Stamped:
        """Take the 37 doubles of a message; return the samples that are ready."""
        if not math.isfinite(sum(values)):
            self.imu_guard.skip("not_finite")
            return []
        verdict = self.imu_guard.check(stamp)
        if verdict is Verdict.SKIP:
            return []
        ready: Stamped = []
        if verdict is Verdict.RESTART:
            ready = self.flush()
            self._pairer.restart(stamp)
        sample = _sample(values, self._dt(stamp, verdict))
        if not self.paired:
            return [*ready, *self.flush(), (stamp, sample)]
        self._waiting.append((stamp, sample))
        return ready + self._completed(self._pairer.add_imu(stamp, readings_of(values)))

    def add_wheels(self, reading: WheelReading) -> Stamped:
        """Take a wheel reading; return the samples it completes."""
        if not math.isfinite(reading.angle + reading.difference):
            self.wheel_guard.skip("not_finite")
            return []
        verdict = self.wheel_guard.check(reading.stamp)
        if verdict is Verdict.SKIP:
            return []
        ready: Stamped = []
        if verdict is Verdict.RESTART:
            ready = self.flush()
            self._pairer.forget_wheels()
        return ready + self._completed(self._pairer.add_wheels(reading))

    def add_motors(self, command: MotorCommand) -> None:
        """Take a command to the motors."""
        self._pairer.add_motors(command)

    def flush(self) -> Stamped:
        """Return the samples that still wait for a wheel, because nothing more arrives."""
        return self._completed(self._pairer.flush()) if self._waiting else []

    def _dt(self, stamp: int, verdict: Verdict) -> float:
        last, self._last_stamp = self._last_stamp, stamp
        if verdict is Verdict.RESTART:
            return UNKNOWN_TIME
        return 0.0 if last is None else (stamp - last) * 1e-9

    def _completed(self, paired: list[tuple[int, Sample]]) -> Stamped:
        return [self._with_pair(sample) for _, sample in paired]

    def _with_pair(self, paired: Sample) -> tuple[int, CorrectedSample]:
        stamp, sample = self._waiting.popleft()
        return stamp, sample._replace(
            wheel_angle=paired.wheel_angle,
            wheel_difference=paired.wheel_difference,
            wheel_count=paired.wheel_count,
            voltage=paired.voltage,
            voltage_difference=paired.voltage_difference,
            motor_count=paired.motor_count,
        )


def readings_of(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2] of an Imu's doubles."""
    return values[GYRO : GYRO + 3] + values[ACCEL : ACCEL + 3]


def _sample(values: tuple[float, ...], dt: float) -> CorrectedSample:
    """Return the sample of an Imu's doubles; its covariances mark what is saturated."""
    rate, force = GYRO_COVARIANCE, ACCEL_COVARIANCE
    return CorrectedSample(
        dt=dt,
        angle=float(tilt_of_quaternion(*values[:4])),
        angle_variance=values[_PITCH_VARIANCE],
        gyro_x=values[GYRO],
        gyro_y=values[GYRO + 1],
        gyro_z=values[GYRO + 2],
        accel_x=values[ACCEL],
        accel_y=values[ACCEL + 1],
        accel_z=values[ACCEL + 2],
        gyro_variance_x=values[rate],
        gyro_variance_y=values[rate + 4],
        gyro_variance_z=values[rate + 8],
        accel_variance_x=values[force],
        accel_variance_y=values[force + 4],
        accel_variance_z=values[force + 8],
        wheel_angle=0.0,
        wheel_difference=0.0,
        wheel_count=0.0,
        gyro_saturated_x=1.0 if values[rate] > GYRO_MARK else 0.0,
        gyro_saturated_y=1.0 if values[rate + 4] > GYRO_MARK else 0.0,
        gyro_saturated_z=1.0 if values[rate + 8] > GYRO_MARK else 0.0,
        accel_saturated_x=1.0 if values[force] > ACCEL_MARK else 0.0,
        accel_saturated_y=1.0 if values[force + 4] > ACCEL_MARK else 0.0,
        accel_saturated_z=1.0 if values[force + 8] > ACCEL_MARK else 0.0,
    )
