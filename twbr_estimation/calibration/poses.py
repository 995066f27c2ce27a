"""Scale errors of the accelerometer from a robot held at known angles.

At rest the specific force is gravity, which the reference encoder resolves into the sensor's
axes. What the readings at +tilt and -tilt of the vertical axis differ by cannot be a scale
error, since the force is the same: it is the pitch of the mounting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import CalibrationError
from ..recording import FloatArray, Recording
from ..robot import Setup
from ..samples import STANDARD_GRAVITY
from .held_poses import Poses, held_poses
from .scale import ScaleFit, fit_scale
from .stillness import LARGEST_ACCEL_BIAS, specific_force

AXES = {"x": 0, "z": 2}
"""The axes a tilting robot turns through gravity, with their columns."""
MOUNTING_LIMIT = math.radians(0.1)
"""Largest standard error at which the mounting is taken over [rad]."""
ZERO_MARGIN = 1.0
"""An axis shows its bias if a pose brings it this close to zero force [m/s^2]."""
SLOPE_UNCERTAINTY = 0.05
"""How far the slope of the readings near zero may be from that over all poses."""
PLAUSIBLE_GAIN = (0.7, 1.4)
"""The readings' slope over the force is within these; others are of another unit or sign."""
_SMOOTH_DEGREE = 5


@dataclass(frozen=True, slots=True)
class AxisResult:
    """Scale calibration of one axis."""

    fit: ScaleFit
    bias: float
    """[m/s^2]"""
    bias_error: float | None
    """Standard error of the bias [m/s^2]; None where it is the configured one."""
    mse_before: float
    """Of single readings without bias against the force, Figs 9 and 10 [(m/s^2)^2]."""
    mse_after: float
    """The same with the scale polynomial [(m/s^2)^2]."""


@dataclass(frozen=True, slots=True)
class PosesResult:
    """Result of held poses."""

    setup: Setup
    """The configuration with polynomials, biases and mounting as estimated."""
    tilt: FloatArray
    """Angles of the poses [rad], (p,)."""
    axes: dict[str, AxisResult]
    pitch: float
    """Correction of the mounting's pitch [rad]."""
    pitch_error: float
    """Its standard error [rad]."""
    pitch_used: bool
    """Whether it was taken over."""


def calibrate_poses(recording: Recording, setup: Setup) -> PosesResult:
    """Estimate the scale polynomials of both axes, and the pitch of the mounting.

    Args:
        recording: a robot held at several angles, with a reference encoder.
        setup: biases (from a robot at rest) and mounting to start from.

    Raises:
        RecordingError: no reference, too few poses, or too small a range of angles.
        CalibrationError: an accelerometer bias that no board has.
    """
    poses = held_poses(recording)
    pitch, pitch_error = _pitch(poses, setup)
    used = pitch_error <= MOUNTING_LIMIT
    if used:
        roll, old, yaw = setup.robot.mounting
        robot = replace(setup.robot, mounting=(roll, old + pitch, yaw))
        setup = replace(setup, robot=robot)
    axes = {axis: _axis(poses, setup, axis, pitch_error) for axis in AXES}
    changes: dict[str, object] = {}
    bias = list(setup.calibration.accel_bias)
    for axis, result in axes.items():
        changes[f"accel_scale_{axis}"] = result.fit.polynomial
        changes[f"accel_valid_{axis}"] = result.fit.valid
        bias[AXES[axis]] = result.bias
    calibration = replace(setup.calibration, accel_bias=tuple(bias), **changes)  # type: ignore[arg-type]
    return PosesResult(
        replace(setup, calibration=calibration), poses.tilt, axes, pitch, pitch_error, used
    )


def _forces(poses: Poses, setup: Setup, axis: str, pitch: float = 0.0) -> FloatArray:
    """Return what an axis of an ideal sensor reads in each pose [m/s^2], (p,)."""
    return np.array([specific_force(tilt + pitch, setup.robot)[AXES[axis]] for tilt in poses.tilt])


def _pitch(poses: Poses, setup: Setup) -> tuple[float, float]:
    """Return the pitch that the vertical axis's asymmetry shows, and its standard error [rad].

    Linear regression of the force on a smooth function of the reading and on what a pitch of
    the mounting does to the force; a pitch acts like more tilt.
    """
    reading = poses.accel[:, AXES["z"]]
    force = _forces(poses, setup, "z")
    slope = (_forces(poses, setup, "z", 1e-3) - _forces(poses, setup, "z", -1e-3)) / 2e-3
    degree = min(_SMOOTH_DEGREE, reading.size - 3)
    mapped = (reading - reading.mean()) / np.ptp(reading)
    design = np.column_stack([np.polynomial.chebyshev.chebvander(mapped, degree), -slope])
    weights, _, rank, _ = np.linalg.lstsq(design, force, rcond=None)
    freedom = reading.size - design.shape[1]
    if rank < design.shape[1] or freedom < 1:
        return 0.0, math.inf
    variance = float(np.sum(np.square(force - design @ weights))) / freedom
    covariance = variance * np.linalg.inv(design.T @ design)
    return float(weights[-1]), float(np.sqrt(covariance[-1, -1]))


def _axis(poses: Poses, setup: Setup, axis: str, pitch_error: float) -> AxisResult:
    column = AXES[axis]
    force, reading = _forces(poses, setup, axis), poses.accel[:, column]
    bias, error = setup.calibration.accel_bias[column], None
    if np.min(np.abs(force)) < ZERO_MARGIN and math.isfinite(pitch_error):
        bias, error = _bias(reading, force)
        _require_plausible(axis, bias)
        weight = STANDARD_GRAVITY * math.hypot(pitch_error, poses.resolution / math.sqrt(12.0))
        error = math.hypot(error, weight)
    _require_gain(axis, reading, force)
    fit = fit_scale(reading - bias, force)
    single = poses.readings[:, column] - bias
    wanted = force[poses.pose]
    before = float(np.mean(np.square(single - wanted)))
    after = float(np.mean(np.square(fit.corrected(single) - wanted)))
    return AxisResult(fit, bias, error, before, after)


def _require_plausible(axis: str, bias: float) -> None:
    if abs(bias) > LARGEST_ACCEL_BIAS:
        raise CalibrationError(
            f"accelerometer {axis}: a bias of {bias:.3g} m/s^2 is not plausible, "
            f"boards are off by up to {LARGEST_ACCEL_BIAS:.3g} m/s^2; check its unit, axes "
            "and robot.mounting"
        )


def _require_gain(axis: str, reading: FloatArray, force: FloatArray) -> None:
    gain = float(np.polyfit(force, reading, 1)[0])
    if not PLAUSIBLE_GAIN[0] < gain < PLAUSIBLE_GAIN[1]:
        raise CalibrationError(
            f"accelerometer {axis}: it reads {gain:.3g} times the force that the reference shows, "
            f"a scale is within {PLAUSIBLE_GAIN[0]:g} and {PLAUSIBLE_GAIN[1]:g}; check its unit "
            "(m/s^2) and axes, sign and unit of the reference (rad, positive leaning forward), "
            "and robot.mounting"
        )


def _bias(reading: FloatArray, force: FloatArray) -> tuple[float, float]:
    """Return the reading at zero force, from the pose nearest to it, and its error [m/s^2].

    A polynomial's value at zero would carry its misfit elsewhere into the bias.
    """
    nearest = int(np.argmin(np.abs(force)))
    slope = float(np.polyfit(force, reading, 1)[0])
    bias = float(reading[nearest]) - slope * float(force[nearest])
    return bias, SLOPE_UNCERTAINTY * abs(float(force[nearest]))
