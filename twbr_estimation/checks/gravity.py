"""Length and direction of gravity in the accelerometer's readings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray
from ..robot import Calibration, Robot
from ..samples import STANDARD_GRAVITY
from .causes import as_configured
from .evidence import BRIEF, Part
from .finding import Finding, Severity, passed
from .rows import Rows, rows_of, spread
from .units import of_accelerometer

DATA_SHEET = 0.12
"""Share by which an uncalibrated MPU6050 may be wrong: 80 mg of bias and 3 % of scale."""
WORST = 0.4
"""Share by which the worst boards are wrong before they are calibrated."""
NOTEWORTHY = 0.05
"""A larger share is worth a warning."""
CERTAIN = 5.0
"""A robot that never rests must be off by this many standard errors more."""
CALM = 0.2
"""A window in which the robot turns less hardly tilts [rad]."""
AT_REST, HARDLY, MEDIAN = "at rest", "hardly tilting", "in the median"
MOVING = 0.3
"""Share by which the median force of a robot that never rests may differ from gravity."""
REMOVED = 0.2
"""A smaller share of gravity counts as 0."""
SCATTERED = 0.3
"""Gravity in another unit scatters less than this share of its length; what moves a robot, more."""
REST_RATE = 0.05
"""Rates below this are rest, whatever the bias [rad/s]."""
REST_FORCE = 0.3
"""Changes of force below this are rest [m/s^2]."""
LEAN = 0.5
"""Cosine of the angle between z and up below which another axis points up."""
_WINDOW = 0.5  # [s]


class Gravity(NamedTuple):
    """What the accelerometer shows of gravity."""

    length: float
    """Median length of the force [m/s^2]."""
    direction: tuple[float, float, float]
    """Median of the force in body axes over its length."""
    motion: str
    """How the robot moved meanwhile: `at rest`, `hardly tilting` or `in the median`."""
    error: float
    """Standard error of the length [m/s^2]."""


class _Window(NamedTuple):
    force: FloatArray
    """Mean specific force [m/s^2], (3,)."""
    resting: bool
    turned: float
    """Range of the angle [rad]."""


def gravity_of(parts: Sequence[Part]) -> Gravity | None:
    """Return gravity as the parts show it, at rest where they rest; None without data."""
    found = [window for part in parts for window in _windows(part)]
    if not found:
        return None
    means = np.array([window.force for window in found])
    motion, chosen = _calmest(found)
    lengths = np.linalg.norm(means[chosen], axis=1)
    length = float(np.median(lengths))
    middle = np.median(means, axis=0) / max(length, 1e-9)
    error = spread(lengths - length) / math.sqrt(lengths.size)
    return Gravity(length, (float(middle[0]), float(middle[1]), float(middle[2])), motion, error)


def _calmest(windows: Sequence[_Window]) -> tuple[str, NDArray[np.bool_]]:
    """Return how the calmest windows move, and which they are."""
    resting = np.array([window.resting for window in windows])
    if resting.sum() >= 3:
        return AT_REST, resting
    calm = np.array([window.turned < CALM for window in windows])
    if calm.sum() >= 5:
        return HARDLY, calm
    return MEDIAN, np.ones(len(windows), dtype=np.bool_)


def _windows(part: Part) -> Iterator[_Window]:
    """Yield the windows of a part."""
    force = part.force()
    size = max(round(_WINDOW / part.step), 2)
    rate = np.diff(part.turn, axis=0) / part.step
    for begin in range(0, force.shape[0] - size + 1, size):
        piece, turning = force[begin : begin + size], rate[begin : begin + size]
        resting = turning.std(axis=0).max() < REST_RATE and piece.std(axis=0).max() < REST_FORCE
        turned = float(np.ptp(part.turn[begin : begin + size + 1], axis=0)[:2].max())
        yield _Window(piece.mean(axis=0), bool(resting), turned)


def gravity(
    parts: Sequence[Part], readings: FloatArray, robot: Robot, calibration: Calibration
) -> Iterator[Finding]:
    """Yield what length and direction of gravity show.

    Args:
        parts: calibrated data.
        readings: of the accelerometer as they are, (n, 3).
        robot: as configured.
        calibration: as configured.
    """
    shown = gravity_of(parts)
    wrong = _wrong_unit(readings)
    if shown is None:
        text = f"no stretch of {BRIEF:g} s to look at"
        yield wrong or Finding(Severity.SKIP, "accelerometer", "gravity", text)
        return
    length = wrong or _length(shown, calibration)
    if shown.length <= REMOVED * STANDARD_GRAVITY and length.severity is Severity.FAIL:
        yield length
        return
    direction = _direction(shown, parts, robot)
    # Calibrated upside down, a sound sensor's length is wrong by twice its bias.
    calibrated = calibration.accel_bias != (0.0, 0.0, 0.0)
    if wrong or not calibrated or direction.severity is not Severity.FAIL:
        yield length
    yield direction


def _wrong_unit(readings: FloatArray) -> Finding | None:
    """Return that readings are in another unit or without gravity, before any calibration."""
    lengths = np.linalg.norm(readings, axis=1)
    length = float(np.median(lengths))
    ratio = length / STANDARD_GRAVITY
    removed = ratio < REMOVED and spread(lengths - length) > SCATTERED * length
    reads = f"its median reading is {length:.3g} where gravity is {STANDARD_GRAVITY:.3g} m/s^2"
    unit = of_accelerometer(ratio)
    if unit and not removed:
        return _unit(f"{reads}: it is in {unit}; give m/s^2", ratio)
    if ratio < REMOVED:
        advice = "gravity was removed; give the specific force, +g on the axis that points up"
        return _unit(f"{reads}: {advice}", ratio)
    return None


def _length(shown: Gravity, calibration: Calibration) -> Finding:
    ratio = shown.length / STANDARD_GRAVITY
    reads = f"{shown.motion} it reads {shown.length:.3g} m/s^2, gravity is {STANDARD_GRAVITY:.3g}"
    off = abs(ratio - 1.0)
    done = calibration.accel_bias != (0.0, 0.0, 0.0)
    if off > (MOVING if shown.motion == MEDIAN else DATA_SHEET if done else WORST):
        return _unit(
            f"{reads}, {100.0 * off:.0f} % {'less' if ratio < 1.0 else 'more'}: check the full "
            "scale the driver assumes and calibration.accel_bias",
            ratio,
        )
    uncertain = 0.0 if shown.motion == AT_REST else CERTAIN * shown.error / STANDARD_GRAVITY
    if shown.motion != MEDIAN and off > NOTEWORTHY + uncertain:
        advice = "its calibration is another sensor's" if done else "calibrate it"
        if off > DATA_SHEET:
            advice += "; a sound MPU6050 is within 12 %, so check the driver's full scale, too"
        return Finding(
            Severity.WARN, "accelerometer", "gravity", f"{reads}: {advice}", ratio, "calibration"
        )
    return passed("accelerometer", "gravity", reads, ratio)


def _unit(text: str, ratio: float) -> Finding:
    return Finding(Severity.FAIL, "accelerometer", "unit", text, ratio)


def _direction(shown: Gravity, parts: Sequence[Part], robot: Robot) -> Finding:
    up = np.array(shown.direction)
    if up[2] >= LEAN:
        return passed("accelerometer", "direction", "gravity is on the axis that points up")
    if up[2] <= -LEAN:
        return _upside_down(parts, robot)
    axis = int(np.argmax(np.abs(up)))
    name = f"{'-' if up[axis] < 0.0 else ''}{'xyz'[axis]}"
    return Finding(
        Severity.FAIL,
        "accelerometer",
        "axes",
        f"gravity is mostly on the body axis {name}, where z should point up: the axes are "
        "swapped, robot.mounting does not say how the sensor sits, or the robot lies",
        float(up[2]),
        "robot.mounting",
    )


class _Turn(NamedTuple):
    """A way to sit, or to report, upside down."""

    text: str
    parameter: str | None
    value: object
    gyro: tuple[float, float, float]
    force: tuple[float, float, float]


_PI = float(np.pi)
_WAYS = (
    _Turn(
        "the driver reports gravity with the wrong sign; +g belongs on the axis that points up",
        None,
        None,
        (1.0, 1.0, 1.0),
        (-1.0, -1.0, -1.0),
    ),
    _Turn(
        "the sensor is mounted upside down, or its axes are forward, right, down; set "
        "robot.mounting to [3.1416, 0, 0]",
        "robot.mounting",
        (_PI, 0.0, 0.0),
        (1.0, -1.0, -1.0),
        (1.0, -1.0, -1.0),
    ),
    _Turn(
        "the sensor is mounted upside down, its x axis backward; set robot.mounting to "
        "[0, 3.1416, 0]",
        "robot.mounting",
        (0.0, _PI, 0.0),
        (-1.0, 1.0, -1.0),
        (-1.0, 1.0, -1.0),
    ),
    _Turn(
        "the sign of its z axis alone is wrong in the driver",
        None,
        None,
        (1.0, 1.0, 1.0),
        (1.0, 1.0, -1.0),
    ),
)


def _upside_down(parts: Sequence[Part], robot: Robot) -> Finding:
    """Return the way to be upside down with which wheels and IMU agree best."""
    rows = rows_of(parts)
    way, known = _WAYS[1], False
    if rows is not None and rows.wheels is not None:
        misfits = [as_configured(_turned(rows, each), robot).misfit for each in _WAYS]
        order = np.argsort(misfits)
        known = misfits[order[0]] < 0.6 * misfits[order[1]]
        # The sign of z alone does not change the forward axis: it ties with a right sensor.
        way = _WAYS[int(order[0])]
    text = (
        way.text
        if known
        else "the driver reports gravity with the wrong sign, or the sensor is mounted upside "
        "down (robot.mounting: [3.1416, 0, 0])"
    )
    return Finding(
        Severity.FAIL,
        "accelerometer",
        "direction",
        f"its z axis points down: {text}",
        -1.0,
        way.parameter if known else "robot.mounting",
        way.value if known else (_PI, 0.0, 0.0),
    )


def _turned(rows: Rows, way: _Turn) -> Rows:
    gyro, force = np.array(way.gyro), np.array(way.force)
    return replace(
        rows,
        force=rows.force * force,
        turn=rows.turn * gyro,
        turning=rows.turning * gyro,
        rate=rows.rate * gyro,
    )
