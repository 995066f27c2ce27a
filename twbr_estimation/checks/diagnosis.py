"""What a cause of contradiction means: severity, words, and the parameter to change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from ..robot import EncoderPlacement, Robot
from .causes import Cause
from .choice import UNKNOWN, Known
from .finding import Finding, Severity
from .rows import on_body
from .units import of_accelerometer, of_gyro, of_length, of_wheels

SIGNIFICANT = 5.0
"""A ratio differs from 1 by at least this many standard errors, or it is 1."""
WARN_RATIO = 1.25
"""Ratios up to this, and down to its inverse, pass."""
FAIL_RATIO = 2.0
"""Ratios beyond this, or below its inverse, fail."""
ARM_MARGIN = 0.05
"""Difference of the lever arm that is worth a warning [m]."""
LONGEST_ARM = 1.0
"""A longer lever arm is no balancing robot's [m]."""
CLOCK_MARGIN = 0.03
"""Offset of the wheels' stamps that is worth a warning [s]."""


_PASS = Severity.PASS


def _severity(ratio: float) -> Severity:
    if ratio <= 1.0 / FAIL_RATIO or ratio >= FAIL_RATIO:
        return Severity.FAIL
    return Severity.PASS if 1.0 / WARN_RATIO < ratio < WARN_RATIO else Severity.WARN


def diagnosis(cause: Cause, robot: Robot, known: Known = UNKNOWN) -> Finding | None:
    """Return what a cause means; None where its ratio is within the limits.

    Args:
        cause: the likeliest.
        robot: as configured.
        known: what other data show.
    """
    if known == UNKNOWN and (_is_backward(cause) or cause.name == "turned 180"):
        return _backward_or_turned(cause, robot)
    if cause.name in _SPECIAL:
        return _SPECIAL[cause.name](cause, robot)
    if abs(cause.ratio - 1.0) < SIGNIFICANT * cause.error or not cause.believable:
        return None
    severity = _severity(cause.ratio)
    return None if severity is Severity.PASS else _SCALES[cause.name](cause, severity, robot)


def _wheels(cause: Cause, severity: Severity, robot: Robot) -> Finding:
    reading = 1.0 / cause.ratio
    if _severity(abs(cause.ratio)) is Severity.PASS:
        return _backward_wheels(reading, severity)
    unit = of_wheels(reading, robot)
    backward = "run backward and " if reading < 0.0 else ""
    named = f"; the angles look like {unit}" if unit else ""
    radius = robot.wheel_radius * cause.ratio
    fits = 0.005 < radius < 0.5
    other = f", or set robot.wheel_radius to {radius:.3g} m" if fits else ""
    return Finding(
        severity,
        "wheels",
        "scale",
        f"the angles contradict the accelerometer: they {backward}read {abs(reading):.3g} times "
        f"the true angle{named}; give angles in rad, positive rolling forward{other}",
        reading,
        "robot.wheel_radius" if fits else None,
        radius if fits else None,
    )


def _is_backward(cause: Cause) -> bool:
    """Return whether wheels, all of them, that read the true angle run backward."""
    return cause.name == "wheels" and cause.ratio < 0.0 and _severity(-cause.ratio) is _PASS


def _backward_or_turned(cause: Cause, robot: Robot) -> Finding:
    """Return what fits encoders that count backward and a sensor that sits the wrong way round."""
    found = _backward_wheels(1.0 / cause.ratio if cause.ratio < 0.0 else -1.0, Severity.FAIL)
    mounting = _turned_mounting(robot, math.pi)
    return replace(
        found,
        text="the angles contradict the accelerometer: they run backward (change `signs` of the "
        "encoders), or the IMU is turned by 180 deg about the vertical, so that accelerometer x "
        "and gyro y both have the wrong sign (set robot.mounting to "
        f"{_shown(mounting)}); turn a wheel forward by hand to see which",
    )


def _turned_mounting(robot: Robot, angle: float) -> tuple[float, float, float]:
    roll, pitch, yaw = robot.mounting
    turned = round(math.remainder(yaw + angle, 2.0 * math.pi), 6)
    return roll, pitch, turned + 0.0  # no -0


def _shown(mounting: tuple[float, float, float]) -> str:
    return "[" + ", ".join(f"{angle:.4g}" for angle in mounting) + "]"


def _turned(cause: Cause, robot: Robot) -> Finding:
    degrees = float(cause.name.removeprefix("turned "))
    mounting = _turned_mounting(robot, math.radians(degrees))
    seen = (
        "accelerometer x and gyro y both have the wrong sign"
        if degrees == 180.0
        else "the x and y axes of accelerometer and gyro are swapped"
    )
    return Finding(
        Severity.FAIL,
        "IMU",
        "mounting",
        f"it is turned by {math.remainder(degrees, 360.0):g} deg about the vertical against "
        f"robot.mounting: {seen}; set robot.mounting to {_shown(mounting)}",
        -1.0 if degrees == 180.0 else None,
        "robot.mounting",
        mounting,
    )


def _backward_wheels(reading: float, severity: Severity) -> Finding:
    return Finding(
        severity,
        "wheels",
        "sign",
        "the angles contradict the accelerometer: they run backward; change `signs` of the "
        "encoders, so that rolling forward is positive",
        reading,
        "signs",
        [-1, -1],
    )


def _radius(cause: Cause, severity: Severity, robot: Robot) -> Finding:
    radius = robot.wheel_radius * cause.ratio
    if cause.ratio < 0.0:
        return _wheels(cause, severity, robot)
    unit = of_length(1.0 / cause.ratio)
    named = f"; it looks like {unit}" if unit else ""
    return Finding(
        severity,
        "wheels",
        "radius",
        f"the wheels' acceleration is {1.0 / cause.ratio:.3g} times what the accelerometer "
        f"shows: robot.wheel_radius is {robot.wheel_radius:g} m, {radius:.3g} m fits{named}",
        1.0 / cause.ratio,
        "robot.wheel_radius",
        radius,
    )


def _gyro(cause: Cause, severity: Severity, robot: Robot) -> Finding:
    del robot
    text = (
        "the pitch rate contradicts wheels and accelerometer: it reads {} times the true rate{}; "
    )
    text += "give rad/s, positive leaning forward, and check robot.mounting"
    return _sensor("gyro", cause, severity, of_gyro, text)


def _accelerometer(cause: Cause, severity: Severity, robot: Robot) -> Finding:
    del robot
    text = "the forward axis contradicts gyro and wheels: it reads {} times the true specific "
    text += "force{}; give m/s^2, +g on the axis that points up, and check robot.mounting"
    return _sensor("accelerometer", cause, severity, of_accelerometer, text)


def _sensor(
    name: str, cause: Cause, severity: Severity, unit_of: Callable[[float], str], text: str
) -> Finding:
    """Return a finding about a sensor; `text` has places for the factor and what it may be."""
    reading = 1.0 / cause.ratio
    unit = unit_of(reading)
    named = f"; it looks like {unit}" if unit else ""
    sign = " with the wrong sign" if reading < 0.0 else ""
    check = "sign" if reading < 0.0 and not unit else "unit"
    text = text.format(f"{abs(reading):.3g}", f"{sign}{named}")
    return Finding(severity, name, check, text, reading, "robot.mounting")


def _axis(cause: Cause, severity: Severity, robot: Robot) -> Finding | None:
    sensor, _, axis = cause.name.partition(" axis ")
    if not 1.0 / FAIL_RATIO < abs(cause.ratio) < FAIL_RATIO:
        return None
    wanted = "pitch rate" if sensor == "gyro" else "forward force"
    sign = "-" if cause.ratio < 0.0 else ""
    return Finding(
        Severity.FAIL,
        sensor,
        "axes",
        f"the {wanted} is on the body axis {sign}{axis}: the axes are swapped; x is forward, "
        "y left, z up; check robot.mounting and the driver",
        1.0 / cause.ratio,
        "robot.mounting",
    )


def _other_axis(cause: Cause, robot: Robot) -> Finding | None:
    return _axis(cause, Severity.FAIL, robot) if cause.believable else None


def _arm(cause: Cause, robot: Robot) -> Finding | None:
    configured, found = robot.lever_arm[2], cause.ratio
    if abs(found - configured) < max(ARM_MARGIN, SIGNIFICANT * cause.error):
        return None
    severity = Severity.FAIL if abs(configured) > LONGEST_ARM else Severity.WARN
    shift = robot.wheel_radius * (1.0 - 2.0 * on_body(robot))
    swapped = abs(found - configured - shift) < 0.7 * robot.wheel_radius
    other = "; or robot.encoder_placement is wrong" if swapped else ""
    return Finding(
        severity,
        "robot",
        "lever arm",
        f"robot.lever_arm says the IMU is {configured:g} m above the axle, {found:.3g} m fit "
        f"the motion{other}",
        configured / found if found else None,
        "robot.lever_arm",
        (robot.lever_arm[0], robot.lever_arm[1], found),
    )


def _placement(cause: Cause, robot: Robot) -> Finding:
    return Finding(
        Severity.WARN,
        "robot",
        "encoder placement",
        f"robot.encoder_placement is {robot.encoder_placement.value}; {cause.name} fits the motion",
        None,
        "robot.encoder_placement",
        cause.name,
    )


def _scaled_wheel(cause: Cause, robot: Robot) -> Finding | None:
    if abs(cause.ratio - 1.0) < SIGNIFICANT * cause.error or not cause.believable:
        return None
    if _severity(abs(cause.ratio)) is _PASS:
        return None if cause.ratio > 0.0 else _one_wheel(_as_reversed(cause), robot)
    side = cause.name.partition(" ")[0]
    reading = 1.0 / cause.ratio
    unit = of_wheels(reading, robot)
    backward = "runs backward and " if reading < 0.0 else ""
    named = f"; its angles look like {unit}" if unit else ""
    return Finding(
        Severity.FAIL,
        "wheels",
        "scale",
        f"the {side} wheel {backward}reads {abs(reading):.3g} times the true angle, the other "
        f"agrees with the accelerometer{named}; give both in rad, positive rolling forward",
        reading,
    )


def _as_reversed(cause: Cause) -> Cause:
    return cause._replace(name=cause.name.replace("scaled", "reversed"), ratio=-1.0)


def _one_wheel(cause: Cause, robot: Robot) -> Finding:
    del robot
    side, _, what = cause.name.partition(" wheel ")
    signs = [-1, 1] if side == "left" else [1, -1]
    backward = what == "reversed"
    fault = "runs backward" if backward else "does not show the wheel's motion"
    return Finding(
        Severity.FAIL,
        "wheels",
        "sign" if backward else "dead",
        f"the {side} wheel {fault}, the other agrees with the accelerometer; "
        + ("change `signs` of the encoders" if backward else "check its encoder and joint name"),
        cause.ratio,
        "signs" if backward else None,
        signs if backward else None,
    )


def _clock(cause: Cause, robot: Robot) -> Finding | None:
    del robot
    offset = cause.ratio
    if abs(offset) < CLOCK_MARGIN:
        return None
    direction = "early" if offset < 0.0 else "late"
    return Finding(
        Severity.WARN if abs(offset) < 2.0 * CLOCK_MARGIN else Severity.FAIL,
        "wheels",
        "clock",
        f"the wheels' stamps are {1e3 * abs(offset):.0f} ms {direction} against the IMU's: their "
        "clocks disagree, or the driver stamps late; stamp both where they are read",
        offset,
    )


_SCALES: Mapping[str, Callable[[Cause, Severity, Robot], Finding | None]] = {
    "wheels": _wheels,
    "wheel radius": _radius,
    "gyro": _gyro,
    "accelerometer": _accelerometer,
}
_SPECIAL: Mapping[str, Callable[[Cause, Robot], Finding | None]] = {
    "lever arm": _arm,
    "wheel clock": _clock,
    **{placement.value: _placement for placement in EncoderPlacement},
    **{f"gyro axis {axis}": _other_axis for axis in "xz"},
    **{f"accelerometer axis {axis}": _other_axis for axis in "yz"},
    **{
        f"{side} wheel {what}": _one_wheel
        for side in ("left", "right")
        for what in ("reversed", "wrong")
    },
    **{f"{side} wheel scaled": _scaled_wheel for side in ("left", "right")},
    **{f"turned {degrees}": _turned for degrees in (90, 180, 270)},
}
