"""The scalar records that travel from the sensors to the tilt estimate.

Axes follow REP-103: x forward, y left, z up; tilt is the pitch about +y, positive when
the robot leans forward. Everything is SI and radians. The records are named tuples of
floats so that the same functions run interpreted and as machine code.
"""

import math
from enum import Enum
from typing import NamedTuple

NANOSECONDS_PER_SECOND = 1_000_000_000
LAST_STAMP = 2**31 * NANOSECONDS_PER_SECOND - 1
"""The latest stamp that the header of a message can hold [ns]."""
SECONDS_PER_NANOSECOND = 1e-9
STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""
SINGLE_WHEEL_JOINT = "wheel_joint"
"""Joint of robots with one wheel encoder; it counts where the two wheels' joints are absent."""
RESTART_GAP = 1.0
"""A longer time between two samples [s] starts correction and filters afresh."""
FASTEST_WHEEL = 200.0
"""No wheel turns faster [rad/s]: the counter wrapped, or began again, or a count was misread."""
LYING = 0.8
"""Further from upright a robot does not balance: it falls, lies or is lifted [rad]."""
OVERTURNED = 0.5 * math.pi
"""Tilt [rad] from which on the accelerometer's angle is taken within half a turn of it."""
IMPLAUSIBLE = 0.4
"""Share of gravity by which a first specific force may differ from it and still show a tilt."""
QUIET_RATE, QUIET_SHARE, QUIET_OFF = 0.15, 0.02, 0.02
"""A first reading of a body at rest turns less than the first [rad/s], differs from gravity by less
than the second, and points less than the third from the first tilt [rad]."""


class Stamps(Enum):
    """Which clock stamps a sample."""

    HEADER = "header"
    """The message's own stamp, of the clock of this computer."""
    ARRIVAL = "arrival"
    """When the message came, or was recorded."""
    DEVICE = "device"
    """The message's own stamp, of a clock of its sender that is related to ours."""


READINGS = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
"""Fields of both kinds of samples that hold the readings of the IMU."""
WHEELS = ("wheel_angle", "wheel_difference", "wheel_count")
MOTORS = ("voltage", "voltage_difference", "motor_count")


class Sample(NamedTuple):
    """One IMU reading as the device reports it, with the wheels at the same instant."""

    dt: float
    """Time since the previous sample [s]; 0 for the first."""
    gyro_x: float
    """Angular rate about the sensor's x axis [rad/s]."""
    gyro_y: float
    gyro_z: float
    accel_x: float
    """Specific force along the sensor's x axis [m/s^2]; +g on the axis that points up."""
    accel_y: float
    accel_z: float
    wheel_angle: float = 0.0
    """Encoder angle, mean of the wheels, positive rolling forward [rad]."""
    wheel_difference: float = 0.0
    """Encoder angle of the right wheel minus that of the left wheel [rad]."""
    wheel_count: float = 0.0
    """Wheel encoders known at this instant: 0, 1 or 2."""
    voltage: float = 0.0
    """Mean of the motors' voltages since the command before this instant [V]."""
    voltage_difference: float = 0.0
    """Voltage of the right motor minus that of the left [V]."""
    motor_count: float = 0.0
    """Motors whose voltage is known: 0, 1 (both get the same) or 2."""


class CorrectedSample(NamedTuple):
    """A calibrated sample in body axes, with the angle of Laddach 2022, eq. (13)."""

    dt: float
    """Time since the previous sample [s]; 0 for the first."""
    angle: float
    """Tilt from the corrected accelerometer, Laddach 2022 (13) [rad]."""
    angle_variance: float
    """Variance of `angle` from sensor noise, inflated on saturation [rad^2]."""
    gyro_x: float
    """Calibrated angular rate about the body's x axis [rad/s]."""
    gyro_y: float
    """Calibrated angular rate about the body's y axis: the tilt rate [rad/s]."""
    gyro_z: float
    accel_x: float
    """Calibrated specific force along the body's x axis [m/s^2]."""
    accel_y: float
    accel_z: float
    gyro_variance_x: float
    """Variance of `gyro_x`, inflated on saturation [(rad/s)^2]."""
    gyro_variance_y: float
    gyro_variance_z: float
    accel_variance_x: float
    """Variance of `accel_x`, inflated on saturation [(m/s^2)^2]."""
    accel_variance_y: float
    accel_variance_z: float
    wheel_angle: float
    """As in `Sample`, and so are the wheels and motors below."""
    wheel_difference: float
    wheel_count: float
    voltage: float = 0.0
    voltage_difference: float = 0.0
    motor_count: float = 0.0
    gyro_saturated_x: float = 0.0
    """1 where the rate about the body's x axis is beyond the gyro's range, else 0."""
    gyro_saturated_y: float = 0.0
    gyro_saturated_z: float = 0.0
    accel_saturated_x: float = 0.0
    """1 where the specific force along the body's x axis is beyond the range, else 0."""
    accel_saturated_y: float = 0.0
    accel_saturated_z: float = 0.0


def is_saturated(sample: CorrectedSample) -> bool:
    """Return whether any axis of gyro or accelerometer is beyond its range."""
    gyro = sample.gyro_saturated_x + sample.gyro_saturated_y + sample.gyro_saturated_z
    accel = sample.accel_saturated_x + sample.accel_saturated_y + sample.accel_saturated_z
    return gyro + accel > 0.0


def is_weightless(sample: Sample | CorrectedSample) -> bool:
    """Return whether the accelerometer reads zero on all axes, as a dead one does.

    It says as little as one at full scale. A gyro that reads zero may be at rest.
    """
    return sample.accel_x == 0.0 and sample.accel_y == 0.0 and sample.accel_z == 0.0


def is_silent(sample: Sample | CorrectedSample) -> bool:
    """Return whether all readings are zero, as of a chip that sleeps or has lost its supply."""
    gyro = sample.gyro_x == 0.0 and sample.gyro_y == 0.0 and sample.gyro_z == 0.0
    return gyro and is_weightless(sample)


def gravity_excess(sample: CorrectedSample) -> float:
    """Return by which share of gravity the specific force is longer, or shorter where below 0."""
    x, y, z = sample.accel_x, sample.accel_y, sample.accel_z
    return math.sqrt(x * x + y * y + z * z) / STANDARD_GRAVITY - 1.0


def shows_gravity(sample: CorrectedSample) -> bool:
    """Return whether the specific force of a first reading is about as long as gravity."""
    return abs(gravity_excess(sample)) <= IMPLAUSIBLE


def shows_rest(sample: CorrectedSample, tilt: float, bias: float) -> bool:
    """Return whether a body at rest may have this reading, and few others.

    Args:
        sample: the first reading.
        tilt: of the body [rad].
        bias: of the gyro's pitch axis [rad/s].
    """
    x, y, z = sample.gyro_x, sample.gyro_y - bias, sample.gyro_z
    turning, off = x * x + y * y + z * z, math.sin(0.5 * (tilt - sample.angle))
    quiet = turning < QUIET_RATE * QUIET_RATE and abs(gravity_excess(sample)) < QUIET_SHARE
    return quiet and abs(off) < 0.5 * QUIET_OFF


def wrapped(angle: float) -> float:
    """Return an angle within half a turn of zero [rad]."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


def nearest(angle: float, tilt: float) -> float:
    """Return the accelerometer's angle [rad] as a filter of that tilt takes it.

    Beyond `OVERTURNED` that is within half a turn of the tilt, which may go on round the circle.
    """
    return angle if abs(tilt) <= OVERTURNED else tilt + wrapped(angle - tilt)


def published(tilt: float) -> float:
    """Return the tilt of a filter that may have gone round the circle, within half a turn [rad]."""
    return tilt if abs(tilt) <= math.pi else wrapped(tilt)


class TiltEstimate(NamedTuple):
    """Result of a filter at the stamp of a sample."""

    tilt: float
    """Tilt [rad], positive leaning forward."""
    rate: float
    """Tilt rate [rad/s]."""
    gyro_bias: float = 0.0
    """Remaining gyro bias [rad/s]; 0 where the filter does not estimate it."""
    tilt_variance: float = 0.0
    """Variance of `tilt` [rad^2]; 0 means unknown, as in a ROS covariance."""
