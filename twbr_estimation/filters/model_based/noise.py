"""Parameters that the filters with a model of the robot share, declared once."""

from __future__ import annotations

from typing import Annotated

from ..base import Bounds

TiltDrift = Annotated[
    float,
    Bounds(
        1e-7,
        0.1,
        "rad/sqrt(s)",
        "Random walk of the tilt beyond its rate. Larger follows the accelerometer faster.",
        logarithmic=True,
    ),
]
WheelDrift = Annotated[
    float,
    Bounds(
        1e-6,
        10.0,
        "rad/sqrt(s)",
        "Random walk of an encoder's angle beyond its rate, by slip or play. Larger follows the "
        "encoder sooner and the model less.",
        logarithmic=True,
    ),
]
TiltRateDrift = Annotated[
    float,
    Bounds(
        1e-5,
        1e3,
        "rad/s/sqrt(s)",
        "What moves the body besides gravity and motors, as pushes do. Larger follows the gyro "
        "instead of the model.",
        logarithmic=True,
    ),
]
WheelRateDrift = Annotated[
    float,
    Bounds(
        1e-5,
        1e3,
        "rad/s/sqrt(s)",
        "What moves the wheels besides the motors, as slopes, friction and pushes do. Larger "
        "follows the encoders instead of the model.",
        logarithmic=True,
    ),
]
WheelNoise = Annotated[
    float,
    Bounds(
        1e-6,
        1.0,
        "rad",
        "Standard deviation of an encoder's angle. Larger follows the model longer.",
        logarithmic=True,
    ),
]
GyroNoise = Annotated[
    float,
    Bounds(
        1e-6,
        1.0,
        "rad/s",
        "Standard deviation of the gyro, or of the sample where that is more. Larger follows the "
        "model longer.",
        logarithmic=True,
    ),
]
AccelNoise = Annotated[
    float,
    Bounds(
        1e-4,
        1e2,
        "m/s^2",
        "Standard deviation of the forward specific force, vibration included. Larger follows gyro "
        "and model longer.",
        logarithmic=True,
    ),
]
AngleNoise = Annotated[
    float,
    Bounds(
        1e-3,
        3.0,
        "rad",
        "Standard deviation of the corrected angle, which counts only where the model cannot be "
        "used.",
        logarithmic=True,
    ),
]
