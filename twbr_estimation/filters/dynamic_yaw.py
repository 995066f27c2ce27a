"""Extended Kalman filter with a model of the robot that turns fast.

Sihite 2018 (40)-(54), with the terms of the squared yaw rate as they are right; see
`plants.sihite2018`. The noise is that of a second, so the sampling period may change; at 5 ms
the defaults are the printed (53), (54).
"""

from typing import Annotated, NamedTuple

from ..robot import Robot
from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter
from .gains import FirstTilt
from .model_based.engine import Coefficients, Noise, PendulumState, start, state_of, stepped
from .model_based.model import model_of
from .model_based.noise import (
    AccelNoise,
    AngleNoise,
    GyroNoise,
    TiltDrift,
    TiltRateDrift,
    WheelDrift,
    WheelNoise,
    WheelRateDrift,
)


class Parameters(NamedTuple):
    """Noise of the model and of the sensors; heading and yaw rate as the wheels'."""

    tilt_drift: TiltDrift = 4.47e-5
    wheel_drift: WheelDrift = 4.47e-3
    tilt_rate_drift: TiltRateDrift = 0.0447
    wheel_rate_drift: WheelRateDrift = 4.47e-3
    wheel_noise: WheelNoise = 3.16e-3
    gyro_noise: GyroNoise = 5.12e-4
    accel_noise: AccelNoise = 0.0738
    angle_noise: AngleNoise = 0.1
    first_tilt: FirstTilt = 0.0175
    printed_yaw_terms: Annotated[
        float,
        Bounds(
            0.0,
            1.0,
            "1",
            "1 takes the terms of the squared yaw rate as printed in (46), (47) and (52), 0 as "
            "they are right.",
            tunable=False,
            historical=True,
        ),
    ] = 0.0


def derive(parameters: Parameters, robot: Robot) -> Coefficients:
    """Return the model of this robot, and variances."""
    q = parameters
    wheel, wheel_rate = q.wheel_drift**2, q.wheel_rate_drift**2
    noise = Noise(
        first=(q.first_tilt**2, 0.0, 0.0, q.gyro_noise**2, 0.0, 0.0),
        growth=(q.tilt_drift**2, wheel, wheel, q.tilt_rate_drift**2, wheel_rate, wheel_rate),
        wheel=q.wheel_noise**2,
        gyro=q.gyro_noise**2,
        accel=q.accel_noise**2,
        heading=q.wheel_noise**2,
        yaw_gyro=0.0,
        angle=q.angle_noise**2,
    )
    model = model_of(robot, turns=True, printed=q.printed_yaw_terms > 0.5)
    return Coefficients(model, noise)


def reset(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> PendulumState:
    """Continue from `estimate`."""
    return state_of(start(estimate, sample, c))


def step(state: PendulumState, sample: CorrectedSample, c: Coefficients) -> PendulumState:
    """Predict by the model, correct with encoders, gyro and specific force."""
    return state_of(stepped(state.core, sample, c))


FILTER = Filter(
    name="dynamic_yaw",
    title="Extended Kalman filter with a model of the robot that turns fast.",
    source="Sihite 2018 (40)-(54)",
    parameters=Parameters,
    state=PendulumState,
    reset=reset,
    step=step,
    derive=derive,
    uses_wheels=True,
    uses_motors=True,
)
