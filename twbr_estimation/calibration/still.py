"""Biases and noise of an IMU from a recording of a robot at rest.

Laddach 2022 records two hours; minutes are enough if the errors are stated with the result.
The error of an accelerometer bias is dominated by what must be assumed to separate a bias
from gravity: the tilt of the robot and the scale of the axis that carries the weight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..checks.blocks import white_deviation, window_means
from ..errors import MotionError, RecordingError
from ..recording import FloatArray, Recording
from ..robot import Calibration, Setup
from .drift import standard_errors
from .stillness import StillnessLimits, Triple, accel_bias, movement_in, specific_force

SHORTEST = 5.0
"""Shortest recording that is accepted [s]."""
USUAL_GYRO_DRIFT = math.radians(0.03)
"""Standard deviation of the slow bias drift of a consumer gyro [rad/s]."""
USUAL_ACCEL_DRIFT = 0.003
"""The same of an accelerometer [m/s^2]."""
SCALE_UNCERTAINTY = 0.01
"""Standard uncertainty of an axis without scale polynomial: a third of the data sheet's 3 %."""
WINDOWS = 50
"""Number of windows the drift is shown over, unless their length is given."""


@dataclass(frozen=True, slots=True)
class StillOptions:
    """Pose of the robot, and the windows that are shown."""

    tilt: float | None = None
    """Tilt of the robot [rad]; None takes the reference's mean, or upright without one."""
    tilt_uncertainty: float = math.radians(0.1)
    """Standard uncertainty of that tilt and of the sensor's mounting [rad]."""
    window: float | None = None
    """Length of the windows of the drift [s]; None divides the recording by `WINDOWS`."""
    limits: StillnessLimits = field(default_factory=StillnessLimits)


@dataclass(frozen=True, slots=True)
class StillResult:
    """Result of a recording at rest."""

    calibration: Calibration
    tilt: float
    """The tilt that was taken as true [rad]."""
    gyro_error: Triple
    """Standard errors of the gyro biases, drift included [rad/s]."""
    accel_error: Triple
    """Standard errors of the accelerometer biases, drift, tilt and scale included [m/s^2]."""
    gyro_noise: Triple
    """Standard deviation of one reading by axis [rad/s]."""
    accel_noise: Triple
    gyro_extremes: tuple[Triple, Triple]
    """Smallest and largest reading, as for Fig. 7 of Laddach 2022 [rad/s]."""
    window: float
    """Length of the windows [s]."""
    gyro_windows: FloatArray
    """Means of the gyro over successive windows, as in Fig. 8 [rad/s], (w, 3)."""
    accel_windows: FloatArray
    """The same of the accelerometer [m/s^2], (w, 3)."""


def calibrate_still(recording: Recording, setup: Setup, options: StillOptions) -> StillResult:
    """Estimate biases and noise.

    Args:
        recording: a robot at rest, upright or at the tilt the reference shows.
        setup: mounting, and the scale polynomials where they are known.
        options: how the robot stood.

    Raises:
        RecordingError: the recording is too short.
        MotionError: the robot moved; the message says when and how much.
        CalibrationError: an accelerometer bias that no board has.
    """
    _require_rest(recording, options.limits)
    imu, dt = recording.imu, recording.dt
    tilt = _tilt(recording, options)
    gyro_bias = triple(imu.gyro.mean(axis=0))
    bias = accel_bias(imu.accel.mean(axis=0), tilt, setup.calibration, setup.robot)
    gyro_noise, accel_noise = white_deviation(imu.gyro), white_deviation(imu.accel)
    calibration = replace(
        setup.calibration,
        gyro_bias=gyro_bias,
        gyro_bias_temperature=_temperature(recording, setup.calibration),
        accel_bias=bias,
        gyro_noise=_pooled(gyro_noise, setup.calibration.gyro_noise),
        accel_noise=_pooled(accel_noise, setup.calibration.accel_noise),
    )
    noise_error = standard_errors(imu.accel, dt, USUAL_ACCEL_DRIFT)
    assumed = _assumed(tilt, setup, options)
    window = options.window or max(recording.duration / WINDOWS, dt)
    return StillResult(
        calibration,
        tilt,
        triple(standard_errors(imu.gyro, dt, USUAL_GYRO_DRIFT)),
        triple(np.hypot(noise_error, assumed)),
        triple(gyro_noise),
        triple(accel_noise),
        (triple(imu.gyro.min(axis=0)), triple(imu.gyro.max(axis=0))),
        window,
        window_means(imu.gyro, round(window / dt)),
        window_means(imu.accel, round(window / dt)),
    )


def _temperature(recording: Recording, calibration: Calibration) -> float:
    """Return the temperature at which the biases hold [degC]; as configured where not known."""
    if recording.temperature is None:
        return calibration.gyro_bias_temperature
    return float(np.mean(recording.temperature.temperature))


def triple(values: FloatArray) -> Triple:
    """Return three array elements as floats."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def _require_rest(recording: Recording, limits: StillnessLimits) -> None:
    if recording.duration < SHORTEST:
        raise RecordingError(
            f"{recording.source}: {recording.duration:.2f} s are too short, "
            f"{SHORTEST:g} s at rest are needed"
        )
    stamps, wheels = recording.imu.stamps, recording.wheels
    ages = (stamps[-1] - stamps) * 1e-9
    wheel = None
    if wheels is not None:
        angles = [np.interp(stamps, wheels.stamps, column) for column in wheels.angle.T]
        wheel = np.stack(angles, axis=1)
    movement = movement_in(ages, recording.imu.gyro, recording.imu.accel, wheel, limits)
    if movement is not None:
        raise MotionError(
            f"{recording.source}: the robot moved during {100.0 * movement.share:.1f} % of the "
            f"{recording.duration:.1f} s, most {float(ages[0]) - movement.age:.1f} s after the "
            f"start: {movement.size}"
        )


def _tilt(recording: Recording, options: StillOptions) -> float:
    if options.tilt is not None:
        return options.tilt
    return 0.0 if recording.reference is None else float(np.mean(recording.reference.tilt))


def _assumed(tilt: float, setup: Setup, options: StillOptions) -> FloatArray:
    """Return the error of each axis that a wrong tilt and an unknown scale cause [m/s^2]."""
    robot, calibration = setup.robot, setup.calibration
    step = 1e-3
    slope = (specific_force(tilt + step, robot) - specific_force(tilt - step, robot)) / (2.0 * step)
    known = [len(getattr(calibration, f"accel_scale_{axis}")) > 0 for axis in "xyz"]
    scale = np.where(known, 0.0, SCALE_UNCERTAINTY) * specific_force(tilt, robot)
    roll = specific_force(tilt, robot)[2] * np.array([0.0, 1.0, 0.0])
    error: FloatArray = np.sqrt(
        np.square(options.tilt_uncertainty) * (slope**2 + roll**2) + scale**2
    )
    return error


def _pooled(deviations: FloatArray, otherwise: float) -> float:
    """Return the rms over the axes; a noiseless sensor keeps what was configured."""
    pooled = float(np.sqrt(np.mean(np.square(deviations))))
    return pooled if pooled > 0.0 else otherwise
