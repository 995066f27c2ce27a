"""Bias, scale and cross-axis of the accelerometer from a robot put on three to six faces.

A face is a stretch at rest with one axis of the sensor near the vertical. Opposite faces give
bias and scale of their axis apart, whatever small tilt the table has; one face alone leans on
the bias that the other faces show, and that on how square the robot was put down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import CalibrationError
from ..recording import FloatArray, Recording
from ..robot import Setup
from ..samples import STANDARD_GRAVITY
from .findings import ACCELERATION, RATIO, CalibrationFinding, Findings
from .held import held
from .stillness import LARGEST_ACCEL_BIAS

UPRIGHT = 0.9
"""Least share of gravity on one axis that makes a face."""
SQUARE = math.radians(1.0)
"""Standard uncertainty of how square a robot is put down [rad]."""
REPEATED = 0.005
"""Standard error of the mean reading of a face from drift and noise [m/s^2]."""
LARGEST_SCALE_ERROR = 0.2
"""A scale further from 1 is another unit."""
_WIDE = (-20.0, 20.0)


@dataclass(frozen=True, slots=True)
class Axis:
    """Result of one axis."""

    bias: float
    bias_error: float
    scale: float
    """Reading over force."""
    scale_error: float
    paired: bool
    """Whether both faces of the axis were there."""


def faces_of(recordings: Sequence[Recording]) -> dict[tuple[int, int], FloatArray]:
    """Return the mean reading of each face, (3,), by axis and sign."""
    found: dict[tuple[int, int], list[FloatArray]] = {}
    for stretch in held(recordings):
        length = float(np.linalg.norm(stretch.accel))
        axis = int(np.argmax(np.abs(stretch.accel)))
        if abs(stretch.accel[axis]) > UPRIGHT * length > 0.0:
            sign = 1 if stretch.accel[axis] > 0.0 else -1
            found.setdefault((axis, sign), []).append(stretch.accel)
    return {face: np.mean(readings, axis=0) for face, readings in found.items()}


def calibrate_faces(recordings: Sequence[Recording], setup: Setup) -> Findings:
    """Estimate bias and scale of every axis, sensor axes.

    Args:
        recordings: together they hold three to six faces, each for a second or more.
        setup: what is replaced.

    Raises:
        CalibrationError: fewer than three axes were vertical, or the result is not plausible.
    """
    faces = faces_of(recordings)
    missing = [name for axis, name in enumerate("xyz") if not {(axis, 1), (axis, -1)} & set(faces)]
    if missing:
        shown = ", ".join(f"{'+' if s > 0 else '-'}{'xyz'[a]}" for a, s in sorted(faces)) or "none"
        raise CalibrationError(
            f"faces: axis {', '.join(missing)} never points up or down (faces found: {shown}); put "
            "the robot on a face for it, for a second or more"
        )
    axes = [_axis(faces, axis) for axis in range(3)]
    for name, axis in zip("xyz", axes, strict=True):
        _require_plausible(name, axis)
    return _findings(faces, axes, setup)


def _axis(faces: dict[tuple[int, int], FloatArray], axis: int) -> Axis:
    up, down = faces.get((axis, 1)), faces.get((axis, -1))
    if up is not None and down is not None:
        half = 0.5 * REPEATED * math.sqrt(2.0)
        lost = STANDARD_GRAVITY * SQUARE**2 / 2.0
        bias, scale = 0.5 * (up[axis] + down[axis]), 0.5 * (up[axis] - down[axis])
        error = math.hypot(half, lost) / STANDARD_GRAVITY
        return Axis(float(bias), half, float(scale) / STANDARD_GRAVITY, error, True)
    across = [reading[axis] for (other, _), reading in faces.items() if other != axis]
    bias = float(np.mean(across))
    bias_error = STANDARD_GRAVITY * SQUARE / math.sqrt(len(across))
    sign, reading = (1.0, up) if up is not None else (-1.0, down)
    assert reading is not None
    scale = sign * (float(reading[axis]) - bias) / STANDARD_GRAVITY
    error = math.hypot(bias_error, REPEATED) / STANDARD_GRAVITY
    return Axis(bias, bias_error, scale, error, False)


def _require_plausible(name: str, axis: Axis) -> None:
    if abs(axis.bias) > LARGEST_ACCEL_BIAS or abs(axis.scale - 1.0) > LARGEST_SCALE_ERROR:
        raise CalibrationError(
            f"accelerometer {name}: bias {axis.bias:.3g} m/s^2 and scale {axis.scale:.3g} are "
            f"none of a sound sensor, within {LARGEST_ACCEL_BIAS:.3g} m/s^2 and "
            f"{LARGEST_SCALE_ERROR:g} of 1: check its unit (m/s^2) and full scale"
        )


def _findings(
    faces: dict[tuple[int, int], FloatArray], axes: Sequence[Axis], setup: Setup
) -> Findings:
    found, notes = [], []
    changes: dict[str, Any] = {}
    for index, (name, axis) in enumerate(zip("xyz", axes, strict=True)):
        before = setup.calibration.accel_bias[index]
        note = "" if axis.paired else "one face only: as good as the robot was put down square"
        found.append(
            CalibrationFinding(
                f"accelerometer bias {name}",
                ACCELERATION,
                before,
                axis.bias,
                axis.bias_error,
                note,
            )
        )
        found.append(
            CalibrationFinding(
                f"accelerometer scale {name}", RATIO, None, axis.scale, axis.scale_error
            )
        )
        changes[f"accel_scale_{name}"] = (1.0 - 1.0 / axis.scale,)
        changes[f"accel_valid_{name}"] = _WIDE
    notes.append(f"{len(faces)} of 6 faces; cross-axis and alignment: {_cross(faces)}")
    changes["accel_bias"] = tuple(axis.bias for axis in axes)
    calibration = replace(setup.calibration, **changes)
    figures = {
        "faces": {
            f"{'xyz'[axis]}{'+' if sign > 0 else '-'}": reading.tolist()
            for (axis, sign), reading in sorted(faces.items())
        }
    }
    result = replace(setup, calibration=calibration)
    return Findings(result, tuple(found), tuple(notes), figures, {})


def _cross(faces: dict[tuple[int, int], FloatArray]) -> str:
    """Return the largest turn between sensor and faces that opposite faces show."""
    largest = 0.0
    for axis in range(3):
        up, down = faces.get((axis, 1)), faces.get((axis, -1))
        if up is None or down is None:
            continue
        across = np.delete(0.5 * (up - down), axis) / STANDARD_GRAVITY
        largest = max(largest, float(np.abs(across).max()))
    return f"up to {math.degrees(largest):.2g} deg" if largest else "needs opposite faces"
