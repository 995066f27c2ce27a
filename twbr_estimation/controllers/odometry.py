"""Position and speed of the robot, from its wheels and its tilt."""

from __future__ import annotations

from typing import NamedTuple

from ..robot import EncoderPlacement, Robot


class WheelGeometry(NamedTuple):
    """Geometry that turns wheel angles into travel."""

    wheel_radius: float
    """[m]."""
    heading_per_difference: float
    """Heading per angle of the right wheel minus that of the left one; 0 where unknown."""
    on_body: float
    """1 where the encoder turns with the body, 0 where it counts against the ground."""
    time_constant: float
    """Of the speeds' low-pass [s]."""


class Odometry(NamedTuple):
    """Travel and speeds at one instant."""

    position: float
    """Travel of the axle [m]."""
    velocity: float
    """[m/s]."""
    heading: float
    """[rad], positive to the left."""
    yaw_rate: float
    """[rad/s]."""
    wheel_angle: float
    """Mean of the wheels [rad], kept for the next step."""


def geometry_of(robot: Robot, time_constant: float) -> WheelGeometry:
    """Return the geometry of a robot."""
    known = robot.track_width > 0.0
    return WheelGeometry(
        robot.wheel_radius,
        robot.wheel_radius / robot.track_width if known else 0.0,
        float(robot.encoder_placement is EncoderPlacement.BODY),
        time_constant,
    )


def begin(wheel_angle: float, wheel_difference: float, tilt: float, g: WheelGeometry) -> Odometry:
    """Return the odometry of a robot at rest; angles in [rad]."""
    position = g.wheel_radius * (wheel_angle + g.on_body * tilt)
    return Odometry(position, 0.0, g.heading_per_difference * wheel_difference, 0.0, wheel_angle)


def follow(
    last: Odometry,
    dt: float,
    wheel_angle: float,
    wheel_difference: float,
    tilt: float,
    rate: float,
    g: WheelGeometry,
) -> Odometry:
    """Return the odometry one step later.

    An encoder on the body counts wheel minus body, so the body's turn is added back: the tilt
    to the position, the tilt rate to the speed, as in Laddach 2022 (18) in its right form.

    Args:
        last: one step ago.
        dt: time since then [s], above 0.
        wheel_angle: mean of the wheels [rad].
        wheel_difference: right minus left [rad]; 0 with one encoder.
        tilt: [rad].
        rate: of the tilt [rad/s].
        g: the robot's geometry.
    """
    position = g.wheel_radius * (wheel_angle + g.on_body * tilt)
    heading = g.heading_per_difference * wheel_difference
    turn = (wheel_angle - last.wheel_angle) / dt + g.on_body * rate
    share = dt / (dt + g.time_constant)
    return Odometry(
        position,
        last.velocity + share * (g.wheel_radius * turn - last.velocity),
        heading,
        last.yaw_rate + share * ((heading - last.heading) / dt - last.yaw_rate),
        wheel_angle,
    )
