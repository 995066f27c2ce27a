"""ROS-shaped messages to and from plain numbers, by attribute; imports no ROS.

Anything with the fields of a message will do: rclpy's messages, those of rosbags, or a test's own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .samples import NANOSECONDS_PER_SECOND

IMU_DOUBLES = 37
"""Doubles of a serialised Imu: three vectors, each with its covariance of nine."""
ORIENTATION, ORIENTATION_COVARIANCE = 0, 4
GYRO, GYRO_COVARIANCE = 13, 16
ACCEL, ACCEL_COVARIANCE = 25, 28
"""Positions of the vectors and their covariances among the doubles."""
POSE_DOUBLES = 7 + 36
"""Doubles of an Odometry before its twist: position, orientation, their covariance."""
UNREPORTED = -1.0
"""First entry of the covariance of a vector that a message does not report (REP-145)."""


def stamp_of(message: Any) -> int:
    """Return the header's stamp [ns]."""
    stamp = message.header.stamp
    seconds: int = stamp.sec
    nanoseconds: int = stamp.nanosec
    return seconds * NANOSECONDS_PER_SECOND + nanoseconds


def set_stamp(message: Any, nanoseconds: int) -> None:
    """Write a stamp [ns] into the header."""
    set_time(message.header.stamp, nanoseconds)


def set_time(time: Any, nanoseconds: int) -> None:
    """Write a time [ns] into a message of seconds and nanoseconds."""
    time.sec, time.nanosec = divmod(nanoseconds, NANOSECONDS_PER_SECOND)


def tilt_of(orientation: Any) -> float:
    """Return the tilt [rad] of a quaternion message; see `tilt_of_quaternion`."""
    return float(tilt_of_quaternion(orientation.x, orientation.y, orientation.z, orientation.w))


def tilt_of_quaternion(x: Any, y: Any, z: Any, w: Any) -> Any:
    """Return the tilt [rad] of quaternions from body to world, numbers or arrays.

    With u the world's up direction in body axes it is atan2(-u_x, u_z): the angle about the
    body's y axis, the wheel axle, that an encoder on the axle measures and that the
    accelerometer of a robot at rest shows, Laddach 2022 (13). It is the pitch of REP-103
    where the robot does not roll, positive leaning forward, and counts to +-pi. The length
    of the quaternion does not matter.
    """
    up_x = 2.0 * (x * z - w * y)
    up_z = w * w - x * x - y * y + z * z
    return np.arctan2(-up_x, up_z)


def set_tilt(orientation: Any, tilt: float) -> None:
    """Write a tilt [rad], without roll and yaw, into a quaternion message."""
    orientation.x = orientation.z = 0.0
    orientation.y, orientation.w = float(np.sin(tilt / 2.0)), float(np.cos(tilt / 2.0))
