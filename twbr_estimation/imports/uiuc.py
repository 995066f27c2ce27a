"""MPU6050 on a motor shaft with a quadrature encoder (University of Illinois).

Published as github.com/ssong47/compute_relative_angle_between_two_IMUs, MIT licence,
MatlabCode/Data: 100 Hz, triangle wave of +-90 deg, 4096 counts per turn. IMU 2 moves with
the shaft; its axes are those of REP-103 already, the shaft being y. There are no wheels.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from ..recording import FloatArray, ImuTrack, Recording, TiltTrack
from ..robot import Calibration, Robot
from ..ros_messages import tilt_of_quaternion
from ..samples import STANDARD_GRAVITY
from .imported import ImportedLog, ImportOptions, stamps_from_seconds
from .matlab import matlab_variables, require_readings

FORMAT = "MATLAB file of the UIUC relative angle set (MPU6050 and encoder on one shaft)"

ENCODER_LAG = 0.008
"""An encoder value belongs to the IMU sample that is this much later in the log [s]."""
GYRO_DELAY = 0.0048
"""Delay of the chip's 42 Hz low-pass, which its motion processor is run with [s]."""
UPRIGHT_DEG = 90.0
"""Encoder angle at which the sensor's z axis points up [deg]."""
MOUNTING_OFFSET_DEG = 0.35
"""Tilt of the sensor on the shaft, added to the reference [deg]."""
_LONGEST = 1e9
"""No time in such a log is as large [s]."""
_GYRO = ("all_gyro_2_x", "all_gyro_2_y", "all_gyro_2_z")
_ACCEL = ("all_accel_2_x", "all_accel_2_y", "all_accel_2_z")
_DMP = ("all_imu2_q1", "all_imu2_q2", "all_imu2_q3", "all_imu2_q4")
"""Quaternion of the chip's own motion processor, w x y z."""


def load(path: Path, options: ImportOptions) -> ImportedLog:
    """Read one file; the chip's own orientation becomes the estimator `dmp`.

    The gyro bias is the mean rate less the rotation the encoder saw from first to last
    sample: the sensor is never at rest.

    Raises:
        RecordingError: not such a file.
    """
    del options
    data = matlab_variables(path, ("all_time", "all_encoder", *_GYRO, *_ACCEL, *_DMP))
    for name, values in data.items():
        if values.ndim != 1 or not np.all(np.isfinite(values)):
            raise RecordingError(f"{path}: {name} is not a row of finite numbers")
    time = data["all_time"]
    if np.abs(time).max() > _LONGEST:
        raise RecordingError(f"{path}: all_time reaches {np.abs(time).max():g} s")
    for name in (*_GYRO, *_ACCEL, *_DMP, "all_encoder"):
        require_readings(path, name, data[name])
    rising = np.append(True, time[1:] > np.maximum.accumulate(time)[:-1])
    repairs = Counter({"rows whose time does not increase dropped": int(np.sum(~rising))})
    if int(rising.sum()) < 2:
        raise RecordingError(f"{path}: all_time does not increase: {time[0]:g} s at the start")
    data = {name: values[rising] for name, values in data.items()}
    time = data["all_time"]
    gyro = np.radians(np.column_stack([data[name] for name in _GYRO]))
    accel = STANDARD_GRAVITY * np.column_stack([data[name] for name in _ACCEL])
    tilt = np.radians(data["all_encoder"] - UPRIGHT_DEG + MOUNTING_OFFSET_DEG)
    stamps = stamps_from_seconds(time, time[0])
    w, x, y, z = (data[name] for name in _DMP)
    recording = Recording(
        source=path.name,
        imu=ImuTrack(stamps, gyro, accel),
        reference=TiltTrack(stamps_from_seconds(time + ENCODER_LAG, time[0]), tilt),
        estimators={"dmp": TiltTrack(stamps, tilt_of_quaternion(x, y, z, w))},
        repairs=dict(+repairs),
    )
    bias = gyro_bias(time, gyro, float(tilt[-1] - tilt[0]))
    robot = Robot(lever_arm=(0.0, 0.0, 0.0), gyro_range=math.radians(500.0), gyro_delay=GYRO_DELAY)
    provenance = {"gyro_bias": "mean rate less the encoder's rotation over the whole file"}
    return ImportedLog(recording, robot, Calibration(gyro_bias=bias), provenance=provenance)


def gyro_bias(time: FloatArray, gyro: FloatArray, rotation: float) -> tuple[float, float, float]:
    """Return the bias of each axis [rad/s] from rates (n, 3) and the rotation about y [rad]."""
    middle = 0.5 * (gyro[1:] + gyro[:-1])
    turned = np.sum(middle * np.diff(time)[:, None], axis=0)
    x, y, z = ((turned - np.array([0.0, rotation, 0.0])) / (time[-1] - time[0])).tolist()
    return x, y, z
