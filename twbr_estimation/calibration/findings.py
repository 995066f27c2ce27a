"""Results of a calibration, quantity by quantity, for a table and for a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ..robot import Setup
from .geometry import UNSEEN, GeometryResult
from .poses import AXES, PosesResult
from .still import StillResult

DEGREES = math.degrees(1.0)


class Unit(NamedTuple):
    """How a quantity is shown; values are stored in SI units and radians."""

    name: str
    """Unit of the stored value."""
    shown: str
    """Unit of the shown value."""
    factor: float
    """Shown value over stored value."""


RATE = Unit("rad/s", "deg/s", DEGREES)
ANGLE = Unit("rad", "deg", DEGREES)
ACCELERATION = Unit("m/s^2", "m/s^2", 1.0)
LENGTH = Unit("m", "mm", 1e3)
TIME = Unit("s", "ms", 1e3)
RATIO = Unit("1", "1", 1.0)
BIAS_SLOPE = Unit("rad/s/K", "deg/s/K", DEGREES)
TEMPERATURE = Unit("degC", "degC", 1.0)


@dataclass(frozen=True, slots=True)
class CalibrationFinding:
    """One quantity."""

    name: str
    unit: Unit
    before: float | None
    """What was configured; None where that has no place in the configuration."""
    value: float | None
    """What was found; None where the recording does not determine it."""
    error: float | None = None
    """Standard error."""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Findings:
    """Everything one calibration found."""

    setup: Setup
    """The configuration with what was found."""
    quantities: tuple[CalibrationFinding, ...]
    notes: tuple[str, ...] = ()
    """Sentences for the reader."""
    figures: Mapping[str, Any] = field(default_factory=dict)
    """Further figures for a JSON file."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Figures that stay with the values in their file."""

    def estimates(self) -> dict[str, dict[str, Any]]:
        """Return the quantities by name, as plain data."""
        return {
            each.name: {
                "unit": each.unit.name,
                "before": each.before,
                "value": each.value,
                "standard_error": each.error,
                "note": each.note,
            }
            for each in self.quantities
        }


def still_findings(result: StillResult, before: Setup) -> Findings:
    """Return the findings of a recording at rest."""
    old, new = before.calibration, result.calibration
    found = []
    for axis, index in (("x", 0), ("y", 1), ("z", 2)):
        found.append(
            CalibrationFinding(
                f"gyro bias {axis}",
                RATE,
                old.gyro_bias[index],
                new.gyro_bias[index],
                result.gyro_error[index],
            )
        )
    for axis, index in (("x", 0), ("y", 1), ("z", 2)):
        found.append(
            CalibrationFinding(
                f"accelerometer bias {axis}",
                ACCELERATION,
                old.accel_bias[index],
                new.accel_bias[index],
                result.accel_error[index],
            )
        )
    found.append(CalibrationFinding("gyro noise", RATE, old.gyro_noise, new.gyro_noise))
    found.append(
        CalibrationFinding("accelerometer noise", ACCELERATION, old.accel_noise, new.accel_noise)
    )
    means = result.gyro_windows[:, 1] * DEGREES
    low, high = (extreme[1] * DEGREES for extreme in result.gyro_extremes)
    notes = (
        f"gyro y reads {low:.4f} to {high:.4f} deg/s; its means over {means.size} windows of "
        f"{result.window:.3g} s lie between {means.min():.4f} and {means.max():.4f} deg/s",
        f"accelerometer biases hold for a tilt of {result.tilt * DEGREES:.3f} deg",
    )
    figures = {
        "tilt": result.tilt,
        "gyro_extremes": result.gyro_extremes,
        "gyro_noise": result.gyro_noise,
        "accel_noise": result.accel_noise,
        "window": result.window,
        "gyro_windows": result.gyro_windows.tolist(),
        "accel_windows": result.accel_windows.tolist(),
    }
    errors = {
        "gyro_bias_error": math.sqrt(sum(error**2 for error in result.gyro_error) / 3.0),
        "accel_bias_error": math.sqrt(sum(error**2 for error in result.accel_error) / 3.0),
    }
    setup = Setup(before.robot, new, before.correction)
    return Findings(setup, tuple(found), notes, figures, errors)


def poses_findings(result: PosesResult, before: Setup) -> Findings:
    """Return the findings of held poses."""
    found = [
        CalibrationFinding(
            "mounting pitch",
            ANGLE,
            before.robot.mounting[1],
            result.setup.robot.mounting[1] if result.pitch_used else None,
            result.pitch_error,
            "" if result.pitch_used else "the poses do not determine it; poses to both sides would",
        )
    ]
    notes, figures, provenance = [], {}, {}
    for axis, each in result.axes.items():
        old = before.calibration.accel_bias[AXES[axis]]
        note = "" if each.bias_error is not None else "kept; no pose takes the weight off this axis"
        value = each.bias if each.bias_error is not None else None
        found.append(
            CalibrationFinding(
                f"accelerometer bias {axis}", ACCELERATION, old, value, each.bias_error, note
            )
        )
        low, high = each.fit.valid
        notes.append(
            f"{axis}: {each.fit.reason}; valid from {low:.2f} to {high:.2f} m/s^2; MSE of single "
            f"readings {each.mse_before:.4f} -> {each.mse_after:.4f} (m/s^2)^2"
        )
        figures[axis] = {
            "polynomial": each.fit.polynomial,
            "valid": each.fit.valid,
            "mse_before": each.mse_before,
            "mse_after": each.mse_after,
            "degrees": {
                str(entry.degree): {
                    "training": entry.training,
                    "validation": entry.validation,
                    "monotonic": entry.monotonic,
                }
                for entry in each.fit.degrees
            },
        }
        provenance[f"mse_before_{axis}"] = each.mse_before
        provenance[f"mse_after_{axis}"] = each.mse_after
    tilt = {"tilt": result.tilt.tolist()}
    return Findings(result.setup, tuple(found), tuple(notes), {**tilt, **figures}, provenance)


def geometry_findings(result: GeometryResult, before: Setup) -> Findings:
    """Return the findings of drives."""
    old, calibration = before.robot, before.calibration
    known = {
        "wheel radius": (LENGTH, old.wheel_radius),
        "lever arm x": (LENGTH, old.lever_arm[0]),
        "lever arm z": (LENGTH, old.lever_arm[2]),
        "mounting pitch": (ANGLE, old.mounting[1]),
        "gyro scale y": (RATIO, calibration.gyro_scale[1]),
        "reference delay": (TIME, None),
        "wheel delay": (TIME, None),
    }
    found = []
    for name, (unit, value) in known.items():
        each = result.estimates[name]
        found.append(CalibrationFinding(name, unit, value, each.value, each.error, each.reason))
    found.append(CalibrationFinding("lever arm y", LENGTH, old.lever_arm[1], None, None, UNSEEN))
    turn = result.body_turn
    notes = [f"as configured: {text}" for text in result.contradictions]
    if result.placement is not None:
        notes.append(
            f"the wheel encoder holds {turn.value:.2f} +- {turn.error:.2f} of the body's turn: "
            f"encoder_placement is {result.placement.value}, was {old.encoder_placement.value}"
        )
    elif turn.value is not None:
        notes.append(turn.reason)
    if result.setup.robot.mounting == old.mounting and result.estimates["mounting pitch"].value:
        notes.append("mounting pitch: no clear contradiction to the configured value, which stays")
    if result.share > 0.0:
        notes.append(f"accelerometer used for {100.0 * result.share:.0f} % of the time")
    placement = None if result.placement is None else result.placement.value
    figures = {
        "encoder_placement": placement,
        "body_turn": {"value": turn.value, "standard_error": turn.error},
        "share": result.share,
    }
    errors = {
        f"{name.replace(' ', '_')}_error": each.error
        for name, each in result.estimates.items()
        if each.value is not None and each.error is not None
    }
    delays = {
        name.replace(" ", "_"): result.estimates[name].value
        for name in ("reference delay", "wheel delay")
        if result.estimates[name].value is not None
    }
    return Findings(result.setup, tuple(found), tuple(notes), figures, {**errors, **delays})
