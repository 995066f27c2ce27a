"""From corrected Imu messages back to corrected samples: the other end of the topic.

An Imu message has room for all of a `CorrectedSample` but the time step, the wheels and the
motors: `dt` comes from the stamps, wheels and motors are paired again for filters that read them.
"""

from __future__ import annotations

import math
from collections import deque

from ..pipeline.pairing import DEFAULT_WAIT
from ..pipeline.physical import LARGEST_VARIANCE, known_variance
from ..pipeline.saturation import ACCEL_MARK, GYRO_MARK
from ..robot import Calibration
from ..ros_messages import (
    ACCEL,
    ACCEL_COVARIANCE,
    GYRO,
    GYRO_COVARIANCE,
    ORIENTATION_COVARIANCE,
    UNREPORTED,
    tilt_of_quaternion,
)
from ..samples import STANDARD_GRAVITY, CorrectedSample, Sample
from .guarded import UNKNOWN_TIME, GuardedPairing, StampedSamples
from .stamps import Verdict

ROLL_YAW_VARIANCE = math.pi**2
"""Variance [rad^2] of angles about which nothing is known."""
SHORTEST, LONGEST = 1e-6, 1e6
"""Limits of a quaternion's squared length, which is 1 or should be."""
_IDENTITY = (0.0, 0.0, 0.0, 1.0)
_NOISE = Calibration()
_GYRO_VARIANCE = _NOISE.gyro_noise**2
_ACCEL_VARIANCE = _NOISE.accel_noise**2
_ANGLE_VARIANCE = _ACCEL_VARIANCE / STANDARD_GRAVITY**2
"""Variances where a message marks them as unknown."""
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
    """Return whether an Imu message reports an orientation: finite, of some length, not unknown."""
    x, y, z, w = values[:4]
    length = x * x + y * y + z * z + w * w
    return (
        SHORTEST <= length <= LONGEST
        and values[ORIENTATION_COVARIANCE] != UNREPORTED
        and not values[_PITCH_VARIANCE] > LARGEST_VARIANCE
    )


def is_default(values: tuple[float, ...]) -> bool:
    """Return whether the orientation is that of a message in which it was never set.

    In ROS 2 it is the identity, with a covariance of zeros, which means unknown (REP-145).
    """
    return values[:4] == _IDENTITY and not any(values[ORIENTATION_COVARIANCE:GYRO])


class CorrectedStream(GuardedPairing):
    """Turns the doubles of corrected Imu messages into samples."""

    def __init__(self, wait: float = DEFAULT_WAIT) -> None:
        """`wait`: how much later [s] than a sample its wheel reading may be stamped."""
        super().__init__(wait)
        self.paired = False
        """Whether samples wait for their wheels and get their motors; else they pass at once."""
        self._waiting: deque[tuple[int, CorrectedSample]] = deque()
        self._last_stamp: int | None = None
        self._restarted = False

    def add_imu(self, stamp: int, values: tuple[float, ...]) -> StampedSamples:
        """Take the 37 doubles of a message; return the samples that are ready."""
        verdict = self._judged(stamp, readings_of(values))
        if verdict is Verdict.SKIP:
            return []
        ready: StampedSamples = []
        if verdict is Verdict.RESTART:
            ready = self.flush()
            self._pairer.restart(stamp)
        sample = _sample(values, self._dt(stamp, verdict))
        if not self.paired:
            return [*ready, *self.flush(), (stamp, sample)]
        self._waiting.append((stamp, sample))
        return ready + self._completed(self._pairer.add_imu(stamp, readings_of(values)))

    def flush(self) -> StampedSamples:
        """Return the samples that still wait for a wheel, because nothing more arrives."""
        return self._completed(self._pairer.flush()) if self._waiting else []

    def begin_afresh(self) -> None:
        """Forget everything but the counts; the filters must be reset, too."""
        self._pairer.reset()
        self._waiting.clear()
        self._last_stamp, self._restarted = None, True

    def _dt(self, stamp: int, verdict: Verdict) -> float:
        last, self._last_stamp = self._last_stamp, stamp
        if verdict is Verdict.RESTART or self._restarted:
            self._restarted = False
            return UNKNOWN_TIME
        return 0.0 if last is None else (stamp - last) * 1e-9

    def _completed(self, paired: list[tuple[int, Sample]]) -> StampedSamples:
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
    gyro = [known_variance(each, _GYRO_VARIANCE) for each in values[rate : rate + 9 : 4]]
    accel = [known_variance(each, _ACCEL_VARIANCE) for each in values[force : force + 9 : 4]]
    return CorrectedSample(
        dt=dt,
        angle=float(tilt_of_quaternion(*values[:4])),
        angle_variance=known_variance(values[_PITCH_VARIANCE], _ANGLE_VARIANCE),
        gyro_x=values[GYRO],
        gyro_y=values[GYRO + 1],
        gyro_z=values[GYRO + 2],
        accel_x=values[ACCEL],
        accel_y=values[ACCEL + 1],
        accel_z=values[ACCEL + 2],
        gyro_variance_x=gyro[0],
        gyro_variance_y=gyro[1],
        gyro_variance_z=gyro[2],
        accel_variance_x=accel[0],
        accel_variance_y=accel[1],
        accel_variance_z=accel[2],
        wheel_angle=0.0,
        wheel_difference=0.0,
        wheel_count=0.0,
        gyro_saturated_x=1.0 if gyro[0] > GYRO_MARK else 0.0,
        gyro_saturated_y=1.0 if gyro[1] > GYRO_MARK else 0.0,
        gyro_saturated_z=1.0 if gyro[2] > GYRO_MARK else 0.0,
        accel_saturated_x=1.0 if accel[0] > ACCEL_MARK else 0.0,
        accel_saturated_y=1.0 if accel[1] > ACCEL_MARK else 0.0,
        accel_saturated_z=1.0 if accel[2] > ACCEL_MARK else 0.0,
    )
