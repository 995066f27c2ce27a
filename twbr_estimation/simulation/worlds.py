"""The worlds an estimator is judged in: what is wrong with robot, sensors and ground."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from ..errors import ConfigurationError
from ..robot import Calibration, Robot

PAPER_CALIBRATION = Calibration(
    gyro_bias=(math.radians(0.8), math.radians(-1.91195), math.radians(-0.5)),
    accel_bias=(0.02340, 0.05, -0.63629),
    accel_scale_x=(0.04537, 0.00576, -0.00143, -0.00005, 0.00001),
    accel_scale_z=(0.12723, -0.05823, 0.00930, -0.00068, 0.00002),
    gyro_noise=math.radians(0.1018),
    accel_noise=0.0348,
)
"""Biases and scale polynomials (52), (53) of Laddach 2022 in body axes.

Forward is -x', so the even powers and the bias of x change sign; the axes the paper does
not use have biases of our own. The noise is the mean of the two accelerometer axes.
"""


@dataclass(frozen=True, slots=True)
class World:
    """One set of imperfections; the defaults are the robot of Laddach 2022."""

    name: str
    summary: str
    """One line for the command's help."""
    gyro_scale_error: float = -0.025
    """Measured rate over true rate, minus one."""
    gyro_acceleration_deg: float = 0.1
    """Gyro reading per acceleration [deg/s per g]."""
    gyro_drift_deg: float = 0.03
    """Standard deviation of the slow bias drift [deg/s]."""
    gyro_noise_deg: float = 0.1018
    """Standard deviation of a gyro reading [deg/s]."""
    gyro_lag: float = 0.001
    """Time constant of the gyro [s]."""
    accel_noise: tuple[float, float, float] = (0.0284, 0.0284, 0.0402)
    """Standard deviation of an accelerometer reading [m/s^2]."""
    accel_bandwidth: float = 260.0
    """-3 dB frequency of the accelerometer [Hz]; 0 for an instantaneous one."""
    calibration: Calibration = PAPER_CALIBRATION
    """The deterministic errors, which the estimator's calibration takes away."""
    calibration_residual: float = 0.0
    """Remainder after calibration [m/s^2], rms over a forward and a vertical axis."""
    digital: bool = True
    """Whether sensors and encoders saturate and are quantised."""
    lever_arm_error: float = 0.0
    """Modulus of the error of the lever arm that the estimator gets [m]."""
    wheel_radius_error: float = 0.0
    """Modulus of the relative error of the wheel radius that the estimator gets."""
    mounting_error_deg: float = 0.0
    """Modulus of the pitch of the IMU that the estimator does not get [deg]."""
    slips_per_second: float = 0.0
    """Rate of wheel slips [1/s]."""
    vibration: float = 1.0
    """Factor on vibration, road bumps, shock ringing and slope."""
    impacts: bool = True
    """Whether the wheels hit obstacles."""
    push_factor: float = 1.0
    """Factor on pushes and commanded motion."""
    command_smoothing: float = 0.0
    """Time over which commands are averaged [s]; 0 lets them jump."""
    track_width: float = 0.0
    """Distance between the wheels, whose encoders are then two, and the robot turns and rolls
    [m]; 0 for one encoder and a drive in a plane."""
    yaw_rate: float = 0.0
    """Fastest turn [rad/s]."""
    roll_deg: float = 0.0
    """Steepest side slope, and highest bump under one wheel [deg]."""
    lateral_arm_error: float = 0.0
    """Offset of the IMU from the middle, to either side, that the estimator does not get [m]."""
    gyro_cross_axis: float = 0.0
    """Modulus of the gyro's cross-axis sensitivity."""
    lever_arm: float = Robot().lever_arm[2]
    """Height of the IMU above the axle [m]."""
    reference_counts: int = 2000
    """Counts of the reference encoder in one turn of the robot."""
    reference_period: float = 0.0
    """Period of the reference [s]; 0 for that of the IMU."""
    control_period: float = 0.005
    """Period of the balance controller, and the delay of its output [s]."""


PAPER = World("paper", "the robot of Laddach 2022, gyro reading 2.5 % low")
IDEAL = World(
    "ideal",
    "perfect sensors, smooth ground and smooth control",
    gyro_scale_error=0.0,
    gyro_acceleration_deg=0.0,
    gyro_drift_deg=0.0,
    gyro_noise_deg=0.0,
    gyro_lag=0.0,
    accel_noise=(0.0, 0.0, 0.0),
    accel_bandwidth=0.0,
    calibration=Calibration(),
    digital=False,
    vibration=0.0,
    impacts=False,
    push_factor=0.5,
    command_smoothing=0.2,
    control_period=0.0005,
)
W1 = replace(PAPER, name="W1", summary="gyro reading 5.5 % low", gyro_scale_error=-0.055)
W2 = replace(
    W1,
    name="W2",
    summary="W1 with slip, wrong geometry and a calibration residual of 0.1 m/s^2",
    calibration_residual=0.1,
    lever_arm_error=0.003,
    wheel_radius_error=0.01,
    mounting_error_deg=0.2,
    slips_per_second=0.2,
)
W3 = replace(
    W2,
    name="W3",
    summary="W2 with a calibration residual of 0.165 m/s^2",
    calibration_residual=0.165,
)
W4 = replace(
    W2,
    name="W4",
    summary="W2 with turns, side slopes, bumps under one wheel and two wheel encoders",
    track_width=0.16,
    yaw_rate=3.0,
    roll_deg=5.0,
    lateral_arm_error=0.01,
    gyro_cross_axis=0.005,
)
STAND = replace(
    PAPER,
    name="stand",
    summary="the verification stand of Chudzik 2021, for its scenes",
    gyro_scale_error=-0.01,
    gyro_noise_deg=0.2,
    accel_noise=(0.019, 0.019, 0.019),
    accel_bandwidth=50.0,
    calibration=Calibration(
        gyro_bias=(0.0, math.radians(0.7), 0.0), gyro_noise=math.radians(0.2), accel_noise=0.019
    ),
    lever_arm=0.02,
    reference_counts=7200,
    reference_period=0.01,
)
"""Bias, and counts and period of the reference, are printed; noise and bandwidth are from the
data sheets of its L3GD20 and LSM303DLHC at 100 Hz; scale error and lever arm are assumed."""

WORLDS: Mapping[str, World] = MappingProxyType(
    {world.name: world for world in (IDEAL, PAPER, W1, W2, W3, W4, STAND)}
)
"""Every world by name."""


def world_named(name: str) -> World:
    """Return the world of that name.

    Raises:
        ConfigurationError: no such world; the message lists those there are.
    """
    try:
        return WORLDS[name]
    except KeyError:
        known = ", ".join(WORLDS)
        raise ConfigurationError(f"there is no world {name!r}; there are: {known}") from None
