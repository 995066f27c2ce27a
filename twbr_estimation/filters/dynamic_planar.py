"""Kalman filter with a model of the robot in a plane.

Sihite 2018, section III-D 4, (55)-(57): the filter of `dynamic_yaw` without heading and yaw rate.
The noise is that of a second; at 5 ms the defaults are the printed (56), (57).
"""

from typing import NamedTuple

from ..robot import Robot
from ..samples import CorrectedSample, TiltEstimate
from .base import Filter
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
    """Noise of the model and of the sensors."""

    tilt_drift: TiltDrift = 4.47e-5
    wheel_drift: WheelDrift = 4.47e-3
    tilt_rate_drift: TiltRateDrift = 0.0447
    wheel_rate_drift: WheelRateDrift = 4.47e-3
    wheel_noise: WheelNoise = 3.16e-3
    gyro_noise: GyroNoise = 1.75e-3
    accel_noise: AccelNoise = 0.0551
    angle_noise: AngleNoise = 0.1
    first_tilt: FirstTilt = 0.0175


def derive(parameters: Parameters, robot: Robot) -> Coefficients:
    """Return the model of this robot, and variances."""
    q = parameters
    noise = Noise(
        first=(q.first_tilt**2, 0.0, 0.0, q.gyro_noise**2, 0.0, 0.0),
        growth=(
            q.tilt_drift**2,
            q.wheel_drift**2,
            0.0,
            q.tilt_rate_drift**2,
            q.wheel_rate_drift**2,
            0.0,
        ),
        wheel=q.wheel_noise**2,
        gyro=q.gyro_noise**2,
        accel=q.accel_noise**2,
        heading=0.0,
        yaw_gyro=0.0,
        angle=q.angle_noise**2,
    )
    return Coefficients(model_of(robot, turns=False), noise)


def reset(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> PendulumState:
    """Continue from `estimate`."""
    return state_of(start(estimate, sample, c))


def step(state: PendulumState, sample: CorrectedSample, c: Coefficients) -> PendulumState:
    """Predict by the model, correct with encoders, gyro and specific force."""
    return state_of(stepped(state.core, sample, c))


FILTER = Filter(
    name="dynamic_planar",
    title="Kalman filter with a model of the robot in a plane.",
    source="Sihite 2018 (55)-(57)",
    parameters=Parameters,
    state=PendulumState,
    reset=reset,
    step=step,
    derive=derive,
    uses_wheels=True,
    uses_motors=True,
)
