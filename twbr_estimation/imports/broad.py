"""Hand-held IMU with optical motion capture: the BROAD set (Laidig et al. 2021, CC BY 4.0).

Published as github.com/dlaidig/broad. The sensor is moved with little rotation, so the set
exercises the correction of accelerations. There are no wheels: a virtual encoder counts the
path along the forward direction from the motion capture's position. Each file serves as two
independent tests, the tilt about the sensor's y axis and that about its x axis; for the
latter body x is sensor -y and body y is sensor x.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from ..recording import FloatArray, ImuTrack, Recording, TiltTrack, WheelTrack
from ..robot import Calibration, CorrectionSettings, EncoderPlacement, Robot
from ..samples import STANDARD_GRAVITY
from .imported import ImportedLog, ImportOptions, uniform_stamps
from .matlab import matlab_variables, number_of, require_readings

FORMAT = "MATLAB file of the BROAD set (IMU and motion capture); see `axis`"

WHEEL_RADIUS = 0.0375
"""Radius of the virtual wheel [m]."""
COUNTS_PER_TURN = 16384
"""Pulses of the virtual encoder per turn of the wheel; magnetic ones have 14 bits."""
POSITION_CUTOFF = 20.0
"""Cut-off of the zero-phase low-pass that keeps the cameras' jitter from the wheel [Hz]."""
VELOCITY_TIME_CONSTANT = 0.02
"""Time constant of the low-pass (19) for this encoder [s], the best of six on trial 14."""
LEAST_LOCATED = 100
"""Fewest positions from which the motion of a wheel is made."""
GYRO_DELAY = 0.0042
"""Lag of the gyro behind the cameras [s]: 3.9 to 4.2 ms in trials 12 and 25."""
BODY_AXES = {
    "y": np.eye(3),
    "x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
"""Body axes as rows in the sensor's axes, by tilt axis."""
_ROBOT = Robot(
    wheel_radius=WHEEL_RADIUS,
    encoder_placement=EncoderPlacement.GROUND,
    lever_arm=(0.0, 0.0, 0.0),
    gyro_range=math.radians(2000.0),
    accel_range=16.0 * STANDARD_GRAVITY,
    gyro_delay=GYRO_DELAY,
)
_COLUMNS = {"imu_gyr": (3,), "imu_acc": (3,), "opt_quat": (4,), "opt_pos": (3,), "movement": ()}
_NAMES = ("imu_gyr", "imu_acc", "opt_quat", "opt_pos", "movement", "sampling_rate")


def load(path: Path, options: ImportOptions) -> ImportedLog:
    """Read one file for the tilt about `options.axis`.

    The reference is there only during the movement that the set's authors use for scores. The
    gyro bias is the mean before the first movement.

    Raises:
        RecordingError: not such a file, or another axis than x and y.
    """
    if options.axis not in BODY_AXES:
        raise RecordingError(f"`axis`: {options.axis}: there are x and y")
    data = matlab_variables(path, _NAMES)
    for name, columns in _COLUMNS.items():
        if data[name].shape[1:] != columns:
            raise RecordingError(f"{path}: {name} has shape {data[name].shape}, not n x {columns}")
    for name in ("imu_gyr", "imu_acc"):
        require_readings(path, name, data[name])
    rate = number_of(path, "sampling_rate", data["sampling_rate"])
    if not 1.0 <= rate <= 1e5:
        raise RecordingError(f"{path}: sampling_rate {rate:g} Hz is not within 1 to 100000")
    axes = BODY_AXES[options.axis]
    moving = data["movement"] > 0.5
    if moving.all() or not moving.any():
        raise RecordingError(f"{path}: `movement` marks no rest before a movement")
    gyro, accel = data["imu_gyr"] @ axes.T, data["imu_acc"] @ axes.T
    rotation = _rotations(data["opt_quat"]) @ axes.T
    seen = np.all(np.isfinite(data["opt_quat"]), axis=1)
    located = seen & np.all(np.isfinite(data["opt_pos"]), axis=1)
    if int(located.sum()) < LEAST_LOCATED:
        raise RecordingError(
            f"{path}: opt_pos and opt_quat are known together in {int(located.sum())} rows; "
            f"{LEAST_LOCATED} are needed"
        )
    angle = wheel_angle(_smoothed(data["opt_pos"][located], rate), rotation[located])
    stamps = uniform_stamps(len(moving), rate)
    scored = moving & seen
    recording = Recording(
        source=f"{path.name}, tilt about {options.axis}",
        imu=ImuTrack(stamps, gyro, accel),
        wheels=WheelTrack(stamps[located], angle[:, None]),
        reference=TiltTrack(stamps[scored], _tilt(rotation[scored])),
    )
    bias_x, bias_y, bias_z = gyro[: int(np.argmax(moving))].mean(axis=0).tolist()
    return ImportedLog(
        recording,
        _ROBOT,
        Calibration(gyro_bias=(bias_x, bias_y, bias_z)),
        CorrectionSettings(velocity_time_constant=VELOCITY_TIME_CONSTANT, dt=1.0 / rate),
        {"gyro_bias": "mean before the first movement", "wheel": "virtual, from positions"},
    )


def _smoothed(position: FloatArray, rate: float) -> FloatArray:
    """Return positions (n, 3) without what is faster than a hand."""
    from scipy.signal import butter, sosfiltfilt

    sections = butter(2, POSITION_CUTOFF, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, position, axis=0), dtype=np.float64)


def wheel_angle(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the virtual encoder's angle [rad], a whole number of pulses.

    Args:
        position: Sensor positions in the world [m], (n, 3).
        rotation: Body to world, (n, 3, 3).
    """
    forward = rotation[:, :2, 0]
    forward = forward / np.linalg.norm(forward, axis=1, keepdims=True)
    middle = 0.5 * (forward[1:] + forward[:-1])
    steps = np.sum(np.diff(position[:, :2], axis=0) * middle, axis=1)
    path = np.append(0.0, np.cumsum(steps))
    pulse = 2.0 * math.pi / COUNTS_PER_TURN
    return np.floor(path / (WHEEL_RADIUS * pulse)) * pulse


def _rotations(quaternions: FloatArray) -> FloatArray:
    """Return rotation matrices (n, 3, 3) of unit quaternions w x y z, (n, 4)."""
    w, x, y, z = quaternions.T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _tilt(rotation: FloatArray) -> FloatArray:
    """Return the tilt from body to world rotations, defined as in `tilt_of_quaternion`."""
    tilt: FloatArray = np.arctan2(-rotation[:, 2, 0], rotation[:, 2, 2])
    return tilt
