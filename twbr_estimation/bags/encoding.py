"""Serialise whole tracks (little-endian XCDR version 1), one message per sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray, ImuTrack, StampArray
from ..ros_messages import (
    ACCEL,
    ACCEL_COVARIANCE,
    GYRO,
    GYRO_COVARIANCE,
    IMU_DOUBLES,
    ORIENTATION,
    ORIENTATION_COVARIANCE,
    UNREPORTED,
)
from ..samples import NANOSECONDS_PER_SECOND

_ENCAPSULATION = b"\x00\x01\x00\x00"


def imu_messages(track: ImuTrack) -> list[bytes]:
    """Return `sensor_msgs/Imu` messages without orientation; covariances unknown."""
    values = np.zeros((track.stamps.size, IMU_DOUBLES))
    values[:, ORIENTATION + 3] = 1.0
    values[:, ORIENTATION_COVARIANCE] = UNREPORTED
    values[:, GYRO : GYRO + 3] = track.gyro
    values[:, ACCEL : ACCEL + 3] = track.accel
    return _messages(track.stamps, _aligned_string(track.frame_id), [values])


def orientation_messages(
    stamps: StampArray, tilt: FloatArray, rate: FloatArray | None, frame_id: str
) -> list[bytes]:
    """Return `sensor_msgs/Imu` messages that carry a tilt as orientation."""
    values = np.zeros((stamps.size, IMU_DOUBLES))
    values[:, ORIENTATION + 1] = np.sin(tilt / 2.0)
    values[:, ORIENTATION + 3] = np.cos(tilt / 2.0)
    values[:, ACCEL_COVARIANCE] = UNREPORTED
    if rate is None:
        values[:, GYRO_COVARIANCE] = UNREPORTED
    else:
        values[:, GYRO + 1] = rate
    return _messages(stamps, _aligned_string(frame_id), [values])


def temperature_messages(stamps: StampArray, temperature: FloatArray, frame_id: str) -> list[bytes]:
    """Return `sensor_msgs/Temperature` messages, variance unknown."""
    values = np.column_stack([temperature, np.zeros_like(temperature)])
    return _messages(stamps, _aligned_string(frame_id), [values])


def float64_array_messages(values: FloatArray) -> list[bytes]:
    """Return `std_msgs/Float64MultiArray` messages without dimensions, one a row."""
    layout = [("head", "<u4", (5,)), ("values", "<f8", (values.shape[1],))]
    rows = np.zeros(values.shape[0], dtype=np.dtype(layout))
    rows["head"] = (0x00000100, 0, 0, values.shape[1], 0)
    rows["values"] = values
    return _rows(rows)


def joint_state_messages(
    stamps: StampArray, names: Sequence[str], position: FloatArray, velocity: FloatArray | None
) -> list[bytes]:
    """Return `sensor_msgs/JointState` messages; `position` and `velocity` are (n, joints)."""
    prefix = _string("", 12)
    prefix += _count(len(names), 12 + len(prefix))
    for name in names:
        prefix += _string(name, 12 + len(prefix))
    prefix += _count(position.shape[1], 12 + len(prefix))
    prefix += b"\0" * ((4 - 12 - len(prefix)) % 8)
    none = np.zeros((stamps.size, 0))
    numbers = [position, none if velocity is None else velocity, none]
    return _messages(stamps, prefix, numbers)


def _messages(stamps: StampArray, prefix: bytes, numbers: Sequence[FloatArray]) -> list[bytes]:
    """Return one message per stamp: header, prefix, sequences of doubles.

    The length of the first sequence belongs to the prefix; the others are written with
    theirs, padded as XCDR requires.
    """
    layout: list[tuple[str, object]] = [
        ("encapsulation", "S4"),
        ("seconds", "<i4"),
        ("nanoseconds", "<u4"),
        ("prefix", f"V{len(prefix)}"),
    ]
    for index, values in enumerate(numbers):
        if index:
            layout.append((f"count{index}", "<u4"))
            if values.shape[1]:
                layout.append((f"padding{index}", "<u4"))
        layout.append((f"values{index}", np.dtype(("<f8", (values.shape[1],)))))
    rows = np.zeros(stamps.size, dtype=np.dtype(layout))
    rows["encapsulation"] = _ENCAPSULATION
    rows["seconds"], rows["nanoseconds"] = np.divmod(stamps, NANOSECONDS_PER_SECOND)
    rows["prefix"] = np.void(prefix)
    for index, values in enumerate(numbers):
        if index:
            rows[f"count{index}"] = values.shape[1]
        rows[f"values{index}"] = values
    return _rows(rows)


def _rows(rows: NDArray[np.void]) -> list[bytes]:
    size = rows.dtype.itemsize
    data = rows.tobytes()
    return [data[start : start + size] for start in range(0, len(data), size)]


def _aligned_string(text: str) -> bytes:
    """Return a serialised frame id, padded so that a double may follow."""
    string = _string(text, 12)
    return string + b"\0" * ((4 - 12 - len(string)) % 8)


def _string(text: str, at: int) -> bytes:
    content = text.encode() + b"\0"
    return _count(len(content), at) + content


def _count(number: int, at: int) -> bytes:
    return b"\0" * (-at % 4) + number.to_bytes(4, "little")
