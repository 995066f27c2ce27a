"""Extended Kalman filter with a model of the robot, which estimates the errors of its IMU.

The filter of Sihite 2018 is worse than the planar one as soon as the gyro measures 0.2 % of the
yaw rate, and its equations for a sensor off the axle's plane contain two misprints. Here the
gyro's bias, the share of the yaw rate in its reading (cross-axis and mounting error), the
accelerometer's bias and the sensor's position before the axle are states; the yaw gyro is a
measurement, too.

A bias of the accelerometer is distinguished from a tilt by the balance: in the model, a robot
without acceleration stands upright. The tilt is therefore that of the line from the axle to the
centre of mass, if the balance point of the model is right.
"""

from typing import Annotated, NamedTuple

from ..robot import Robot
from ..samples import CorrectedSample, TiltEstimate
from .base import Bounds, Filter
from .gains import BiasDrift, FirstBias, FirstTilt
from .model_based.engine import Coefficients, Core, Noise, start, stepped
from .model_based.model import GYRO_BIAS, TILT, TILT_RATE, model_of
from .model_based.noise import (
    AccelNoise,
    AngleNoise,
    GyroNoise,
    TiltRateDrift,
    WheelDrift,
    WheelNoise,
    WheelRateDrift,
)


class Parameters(NamedTuple):
    """Noise of the model and of the sensors, and how wrong the sensors may be."""

    wheel_drift: WheelDrift = 4.47e-3
    tilt_rate_drift: TiltRateDrift = 0.2
    wheel_rate_drift: WheelRateDrift = 0.5
    yaw_rate_drift: WheelRateDrift = 0.5
    wheel_noise: WheelNoise = 3.16e-3
    gyro_noise: GyroNoise = 5.12e-4
    accel_noise: AccelNoise = 0.6
    bias_drift: BiasDrift = 2e-4
    bias: FirstBias = 0.002
    cross_axis: Annotated[
        float,
        Bounds(
            0.0,
            0.2,
            "1",
            "Standard deviation of the share of the yaw rate in the tilt gyro's reading, at the "
            "start.",
            logarithmic=True,
            tunable=False,
        ),
    ] = 0.02
    accel_bias: Annotated[
        float,
        Bounds(
            0.0,
            2.0,
            "m/s^2",
            "Standard deviation of the forward accelerometer's bias that calibration left, at the "
            "start.",
            logarithmic=True,
            tunable=False,
        ),
    ] = 0.1
    offset: Annotated[
        float,
        Bounds(
            0.0,
            0.2,
            "m",
            "Standard deviation of the IMU's offset forward or backward from its stated position, "
            "at the start.",
            logarithmic=True,
            tunable=False,
        ),
    ] = 0.02
    angle_noise: AngleNoise = 0.1
    first_tilt: FirstTilt = 0.0175


class State(NamedTuple):
    """Estimate and what it comes from."""

    tilt: float
    rate: float
    gyro_bias: float
    tilt_variance: float
    core: Core


def derive(parameters: Parameters, robot: Robot) -> Coefficients:
    """Return the model of this robot, and variances."""
    q = parameters
    wrong = (q.bias**2, q.cross_axis**2, q.accel_bias**2, q.offset**2)
    wheel, tilt_rate = q.wheel_drift**2, q.tilt_rate_drift**2
    rates = (tilt_rate, q.wheel_rate_drift**2, q.yaw_rate_drift**2)
    noise = Noise(
        first=(q.first_tilt**2, 0.0, 0.0, q.gyro_noise**2, 0.0, 0.0, *wrong),
        growth=(0.0, wheel, wheel, *rates, q.bias_drift**2, 0.0, 0.0, 0.0),
        wheel=q.wheel_noise**2,
        gyro=q.gyro_noise**2,
        accel=q.accel_noise**2,
        heading=q.wheel_noise**2,
        yaw_gyro=q.gyro_noise**2,
        angle=q.angle_noise**2,
    )
    return Coefficients(model_of(robot, turns=True, change_share=0.5), noise)


def reset(estimate: TiltEstimate, sample: CorrectedSample, c: Coefficients) -> State:
    """Continue from `estimate`; all but the gyro bias is learned again."""
    return _state_of(start(estimate, sample, c))


def step(state: State, sample: CorrectedSample, c: Coefficients) -> State:
    """Predict by the model, correct with encoders, gyro and specific force."""
    return _state_of(stepped(state.core, sample, c))


def _state_of(core: Core) -> State:
    x, variance = core.x, float(core.p[TILT, TILT])
    return State(float(x[TILT]), float(x[TILT_RATE]), float(x[GYRO_BIAS]), variance, core)


FILTER = Filter(
    name="dynamic_calibrating",
    title="Extended Kalman filter with a model of the robot, which learns its IMU's errors.",
    source="after Sihite 2018 (40)-(54)",
    parameters=Parameters,
    state=State,
    reset=reset,
    step=step,
    derive=derive,
    uses_wheels=True,
    uses_motors=True,
)
