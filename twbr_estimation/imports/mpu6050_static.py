"""MPU6050 at rest and turned by hand: sunsided's sensor fusion data, set 2 (EUPL 1.2).

Published as github.com/sunsided/sensor-fusion, data/set-2: one folder a recording, MATLAB
7.3 files. The gyro's axes are the chip's; the accelerometer's x and y have the sign of
specific force in these axes and its z that of gravity, so z is turned around.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from ..recording import FloatArray, ImuTrack, Recording, TemperatureTrack, TiltTrack
from ..robot import Calibration, Robot
from ..samples import STANDARD_GRAVITY
from .imported import ImportedLog, ImportOptions, uniform_stamps
from .matlab import ELEMENT_LIMIT

FORMAT = "folder of the static MPU6050 set (three MATLAB 7.3 files)"

RATE = 99.4
"""Sampling rate [Hz]; the files' own stamps are arrival times in bursts."""
STILL_DEG_S = 0.5
"""A record is still where no axis varies more, standard deviation [deg/s]."""
_FILES = {
    "accelBuffer": "mpu6050_accelerometer.mat",
    "gyroBuffer": "mpu6050_gyroscope.mat",
    "temperatureBuffer": "mpu6050_temperature.mat",
}


def load(path: Path, options: ImportOptions) -> ImportedLog:
    """Read one folder (or any file in it).

    A still record gets its mean rate as gyro bias and its mean accelerometer angle as a
    constant reference; that reference shows drift and noise, not the true angle.

    Raises:
        RecordingError: not such a folder, or h5py is not installed.
    """
    del options
    folder = path if path.is_dir() else path.parent
    data = {name: _buffer(folder / file, name) for name, file in _FILES.items()}
    count = min(values.shape[1] for values in data.values())
    stamps = uniform_stamps(count, RATE)
    gyro = np.radians(data["gyroBuffer"][1:4, :count].T)
    accel = STANDARD_GRAVITY * data["accelBuffer"][1:4, :count].T * np.array([1.0, 1.0, -1.0])
    still = bool(np.all(np.degrees(gyro.std(axis=0)) < STILL_DEG_S))
    recording = Recording(
        source=folder.name,
        imu=ImuTrack(stamps, gyro, accel),
        reference=_constant_reference(stamps, accel) if still else None,
        temperature=TemperatureTrack(stamps, data["temperatureBuffer"][1, :count]),
    )
    x, y, z = gyro.mean(axis=0).tolist() if still else (0.0, 0.0, 0.0)
    robot = Robot(
        lever_arm=(0.0, 0.0, 0.0),
        gyro_range=math.radians(250.0),
        accel_range=8.0 * STANDARD_GRAVITY,
    )
    origin = "mean of this recording" if still else "unknown: the sensor moves"
    calibration = Calibration(gyro_bias=(x, y, z))
    return ImportedLog(recording, robot, calibration, provenance={"gyro_bias": origin})


def _constant_reference(stamps: np.ndarray, accel: FloatArray) -> TiltTrack:
    x, _, z = accel.mean(axis=0).tolist()
    return TiltTrack(stamps, np.full(stamps.size, math.atan2(-x, z)))


def _buffer(path: Path, name: str) -> FloatArray:
    """Return one variable, (rows, n)."""
    try:
        import h5py
    except ImportError as error:
        raise RecordingError(
            f"{path}: MATLAB 7.3 files need h5py: pip install 'twbr_estimation[import]'"
        ) from error
    try:
        if not path.is_file():
            raise FileNotFoundError("there is no such file")
        with h5py.File(path) as file:
            if file[name].size > ELEMENT_LIMIT or file[name].ndim != 2:
                raise ValueError(f"shape {file[name].shape}")
            return np.asarray(file[name][()], dtype=np.float64)
    except (RuntimeError, OSError, KeyError, ValueError, TypeError, MemoryError) as error:
        raise RecordingError(f"{path}: no MATLAB 7.3 file with {name}: {error}") from error
