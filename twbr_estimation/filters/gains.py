"""Parameters that several filters share, declared once."""

from __future__ import annotations

from typing import Annotated

from .base import Bounds

AngleGain = Annotated[
    float,
    Bounds(
        0.0,
        1.0,
        "1",
        "Gain of the angle residual on the tilt. Larger follows the accelerometer faster and "
        "passes more of its noise.",
    ),
]
RateGain = Annotated[
    float,
    Bounds(
        0.0,
        2.0,
        "1",
        "Gain of the rate residual on the rate. 1 takes the gyro as it is; smaller smooths it; "
        "above 1 looks ahead, which undoes the half sample of lag of the prediction.",
    ),
]
BiasDrift = Annotated[
    float,
    Bounds(
        0.0,
        1e-2,
        "rad/s/sqrt(s)",
        "Wandering of the gyro bias. Larger learns it faster and less smoothly.",
        logarithmic=True,
    ),
]
FirstBias = Annotated[
    float,
    Bounds(
        0.0,
        1.0,
        "rad/s",
        "Standard deviation of the bias that calibration left, at the start.",
        logarithmic=True,
        tunable=False,
    ),
]
FirstTilt = Annotated[
    float,
    Bounds(
        1e-4,
        0.2,
        "rad",
        "Standard deviation of the first tilt.",
        logarithmic=True,
        tunable=False,
    ),
]
