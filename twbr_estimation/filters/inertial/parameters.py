"""Parameters of `ins_odometer`: sensor noise, quality of calibration, ground and room.

All are physical and hold at any sampling period; the defaults describe a calibrated MPU6050
on a robot indoors.
"""

import math
from typing import Annotated, NamedTuple

from ...parameters.bounds import Bounds
from ...robot import EncoderPlacement, Robot
from .aiding import ROOM_PERIOD, Geometry

GUIDED_DRIFT = 0.5
"""Share of the gyro's drift with wheels: they may be wrong, and then pull its bias less."""


class Parameters(NamedTuple):
    """Properties of sensors, calibration and ground."""

    gyro_bias: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "rad/s",
            "Standard deviation of the gyro bias that calibration left. "
            "Larger learns it faster at the start.",
            logarithmic=True,
        ),
    ] = math.radians(0.3)
    gyro_drift: Annotated[
        float,
        Bounds(
            0.0,
            1e-2,
            "rad/s/sqrt(s)",
            f"Wandering of the gyro bias; with wheels {GUIDED_DRIFT:g} times it. Larger follows "
            "temperature faster and lets more noise into the bias.",
            logarithmic=True,
        ),
    ] = 2e-4
    gyro_gain: Annotated[
        float,
        Bounds(0.0, 0.2, "1", "Standard deviation of the gyro's relative gain error."),
    ] = 0.06
    accel_bias: Annotated[
        float,
        Bounds(
            0.0,
            2.0,
            "m/s^2",
            "Standard deviation of what calibration left of the accelerometer's errors.",
            logarithmic=True,
        ),
    ] = 0.02
    accel_bias_time: Annotated[
        float,
        Bounds(0.1, 1e4, "s", "Time over which that error changes.", logarithmic=True),
    ] = 30.0
    accel_scale: Annotated[
        float,
        Bounds(
            0.0,
            0.5,
            "1",
            "Relative error of accelerations, from the accelerometer's scale and alignment.",
        ),
    ] = 0.02
    accel_residual: Annotated[
        float,
        Bounds(
            0.0,
            2.0,
            "m/s^2",
            "Standard deviation of what calibration left of the forward accelerometer's errors "
            "away from zero.",
        ),
    ] = 0.03
    gyro_cross: Annotated[
        float,
        Bounds(
            0.0,
            0.1,
            "1",
            "Standard deviation of the share of the yaw rate that the gyro reads as roll.",
        ),
    ] = 0.005
    wheel_radius: Annotated[
        float,
        Bounds(0.0, 0.2, "1", "Standard deviation of the relative error of the wheel radius."),
    ] = 0.01
    mounting: Annotated[
        float,
        Bounds(
            0.0,
            0.2,
            "rad",
            "Standard deviation of the sensor's pitch in the body and of what the accelerometer's "
            "zero makes of it. Nothing on board can see it: it counts in the variance only.",
            tunable=False,
        ),
    ] = math.radians(0.45)
    lever_arm: Annotated[
        float,
        Bounds(0.0, 0.2, "m", "Standard deviation of the error of the lever arm's height."),
    ] = 0.005
    lever_left: Annotated[
        float,
        Bounds(
            0.0, 0.2, "m", "Standard deviation of the error of the lever arm's place to the left."
        ),
    ] = 0.003
    wheel_noise: Annotated[
        float,
        Bounds(
            1e-5,
            0.1,
            "m",
            "Standard deviation of a wheel reading: encoder steps, play "
            "and unevenness of the ground.",
            logarithmic=True,
        ),
    ] = 5e-4
    slip: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "m/sqrt(m)",
            "Error of the distance rolled per root of the distance.",
            logarithmic=True,
        ),
    ] = 0.01
    room: Annotated[
        float,
        Bounds(
            0.01,
            100.0,
            "m",
            "How far the robot strays within `room_time` where no wheel "
            "tells. Smaller trusts the accelerometer sooner.",
            logarithmic=True,
        ),
    ] = 0.5
    room_time: Annotated[
        float,
        Bounds(0.1, 1e3, "s", "Time over which a displacement is forgotten.", logarithmic=True),
    ] = 10.0
    speed: Annotated[
        float,
        Bounds(
            0.01,
            100.0,
            "m/s",
            "How fast the robot is without wheel readings. Smaller recovers sooner from a fall and "
            "takes more of an acceleration for tilt.",
            logarithmic=True,
        ),
    ] = 1.0


class Coefficients(NamedTuple):
    """Parameters and robot as the numbers a step needs."""

    gyro_bias: float
    gyro_drift: float
    gyro_gain: float
    accel_bias: float
    accel_bias_time: float
    accel_scale: float
    accel_residual: float
    gyro_cross: float
    wheel_radius: float
    mounting_variance: float
    lever_arm: float
    lever_left: float
    room_time: float
    gyro_delay: float
    geometry: Geometry


def derive(parameters: Parameters, robot: Robot) -> Coefficients:
    """Put parameters and geometry together."""
    geometry = Geometry(
        lever=robot.lever_arm,
        wheel_radius=robot.wheel_radius,
        on_body=float(robot.encoder_placement is EncoderPlacement.BODY),
        wheel_noise=parameters.wheel_noise,
        slip=parameters.slip,
        room=parameters.room,
        speed=parameters.speed,
        # A displacement stays alike for `room_time`: one comparison within it is news.
        room_share=min(ROOM_PERIOD / parameters.room_time, 1.0),
        yaw_per_difference=robot.wheel_radius / robot.track_width if robot.track_width else 0.0,
    )
    return Coefficients(
        parameters.gyro_bias,
        parameters.gyro_drift,
        parameters.gyro_gain,
        parameters.accel_bias,
        parameters.accel_bias_time,
        parameters.accel_scale,
        parameters.accel_residual,
        parameters.gyro_cross,
        parameters.wheel_radius,
        parameters.mounting * parameters.mounting,
        parameters.lever_arm,
        parameters.lever_left,
        parameters.room_time,
        robot.gyro_delay,
        geometry,
    )
