"""The user's robot: geometry, sensors, mechanics and their calibration, as plain data.

The field names are the names in `robot.yaml` and `calibration.yaml` and the parameter
names of the nodes; `yaml_files` and the nodes derive theirs from these classes. Defaults
describe an MPU6050 on the robot of Laddach 2022.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from .errors import ConfigurationError
from .plants.laddach2022 import PlantParameters

_MECHANICS = (
    "body_mass",
    "body_inertia",
    "body_inertia_roll",
    "body_inertia_yaw",
    "wheel_mass",
    "wheel_inertia",
    "wheel_inertia_across",
    "gear_ratio",
    "winding_resistance",
    "torque_constant",
    "back_emf_constant",
    "supply_voltage",
)
POLYNOMIAL_DEGREE = 10
"""Highest degree of an accelerometer scale polynomial."""
LONGEST_DELAY = 0.1
"""Longest delay of a gyro [s]; the slowest filter of the MPU6050 takes 19 ms."""


class EncoderPlacement(str, Enum):
    """What the wheel encoder counts."""

    BODY = "body"
    """Wheel minus body: the encoder's housing turns with the robot."""
    GROUND = "ground"
    """The wheel's own turn, referred to ground."""


@dataclass(frozen=True, slots=True)
class Robot:
    """Geometry, sensors and mechanics of one robot, SI units, body axes as in REP-103.

    The mechanics serve controllers, filters with a model of the robot, and simulations only.
    Their defaults are the simulated rig's; body and wheels are separate: the motors' stators
    belong to the body, their rotors are neglected.

    Raises:
        ConfigurationError: a value outside its physical range.
    """

    wheel_radius: float = 0.0375
    """Wheel radius [m]."""
    track_width: float = 0.0
    """Distance between the wheels [m]; 0 where unknown."""
    encoder_placement: EncoderPlacement = EncoderPlacement.BODY
    """Whether the encoder counts against the body or against the ground."""
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.135)
    """Position of the IMU relative to the middle of the wheel axle, body axes [m]."""
    mounting: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw of the sensor in the body [rad], fixed axes as in URDF."""
    gyro_range: float = math.radians(250.0)
    """Full scale of the gyro [rad/s]; readings at it are saturated."""
    accel_range: float = 2.0 * 9.80665
    """Full scale of the accelerometer [m/s^2]."""
    gyro_delay: float = 0.00098
    """How much the gyro's low-pass lags behind the motion [s]; the MPU6050's without filter."""
    body_mass: float = 1.0
    """Mass of the body without the wheels [kg]."""
    body_height: float = 0.09
    """Height of the body's centre of mass above the axle [m]; below 0 it hangs."""
    body_inertia: float = 0.0045
    """Moment of inertia of the body about its centre of mass, pitch axis [kg m^2]."""
    body_inertia_roll: float = 0.006
    """The same for the roll axis."""
    body_inertia_yaw: float = 0.002
    """The same for the yaw axis."""
    wheel_mass: float = 0.06
    """Mass of one wheel [kg]."""
    wheel_inertia: float = 5e-5
    """Moment of inertia of one wheel about the axle [kg m^2]."""
    wheel_inertia_across: float = 2.5e-5
    """Moment of inertia of one wheel about a diameter [kg m^2]."""
    gear_ratio: float = 30.0
    """Turns of a motor in one turn of its wheel."""
    winding_resistance: float = 2.2
    """Resistance of one motor's winding [ohm]."""
    torque_constant: float = 0.0083
    """Torque of one motor per current, before the gear [N m/A]."""
    back_emf_constant: float = 0.0112
    """Voltage that one motor induces per rate, before the gear [V s/rad]."""
    supply_voltage: float = 12.0
    """Largest voltage at a motor [V]."""

    def __post_init__(self) -> None:
        _require_positive(self, ("wheel_radius", "gyro_range", "accel_range", *_MECHANICS))
        _require_finite(self)
        if self.track_width < 0.0:
            raise ConfigurationError(f"robot.track_width: {self.track_width} m is below 0")
        if not 0.0 <= self.gyro_delay <= LONGEST_DELAY:
            raise ConfigurationError(
                f"robot.gyro_delay: {self.gyro_delay} s is not within 0 and {LONGEST_DELAY} s"
            )
        object.__setattr__(self, "encoder_placement", EncoderPlacement(self.encoder_placement))

    def plant(self) -> PlantParameters:
        """Return the parameters of the planar model, Laddach 2022 (2)."""
        return PlantParameters(*(getattr(self, name) for name in PlantParameters._fields))

    def rotation(self) -> NDArray[np.float64]:
        """Return the 3x3 rotation that turns sensor axes into body axes."""
        (sr, sp, sy), (cr, cp, cy) = np.sin(self.mounting), np.cos(self.mounting)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
        about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
        about_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(about_z @ about_y @ about_x, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Calibration:
    """Deterministic errors and noise of one IMU, in the sensor's own axes.

    A scale polynomial S has no constant term; `accel_scale_x[k]` multiplies p^(k+1), and
    the corrected value is p - S(p) with p the reading free of bias, Laddach 2022 (11).
    """

    gyro_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Gyro readings at rest [rad/s]."""
    gyro_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """True rate divided by measured rate, an extension of (8); 1 as in the paper."""
    accel_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Accelerometer biases [m/s^2]."""
    accel_scale_x: tuple[float, ...] = ()
    """Coefficients of the scale polynomial of the x axis, from the first degree up."""
    accel_scale_y: tuple[float, ...] = ()
    """Coefficients of the scale polynomial of the y axis, from the first degree up."""
    accel_scale_z: tuple[float, ...] = ()
    """Coefficients of the scale polynomial of the z axis, from the first degree up."""
    accel_valid_x: tuple[float, float] = (-9.9, 9.9)
    """Range of the polynomial's argument; beyond it the argument of S is clamped [m/s^2]."""
    accel_valid_y: tuple[float, float] = (-9.9, 9.9)
    """The same for the y axis."""
    accel_valid_z: tuple[float, float] = (-2.0, 10.2)
    """The same for the z axis."""
    gyro_noise: float = math.radians(0.1)
    """Standard deviation of one gyro reading [rad/s]."""
    accel_noise: float = 0.04
    """Standard deviation of one accelerometer reading [m/s^2]."""

    def __post_init__(self) -> None:
        _require_positive(self, ("gyro_noise", "accel_noise"))
        _require_finite(self)
        for axis in "xyz":
            if len(getattr(self, f"accel_scale_{axis}")) > POLYNOMIAL_DEGREE:
                raise ConfigurationError(
                    f"calibration.accel_scale_{axis}: degree "
                    f"{len(getattr(self, f'accel_scale_{axis}'))} is above {POLYNOMIAL_DEGREE}"
                )
            low, high = getattr(self, f"accel_valid_{axis}")
            if not low < high:
                raise ConfigurationError(
                    f"calibration.accel_valid_{axis}: lower limit {low} is not below {high}"
                )


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """Which motion terms are removed, and how strongly their inputs are smoothed.

    Raises:
        ConfigurationError: a time constant at which its low-pass is unstable.
    """

    rate_time_constant: float = 0.06874
    """T of the low-pass (16) before the angular acceleration [s]; above -dt/2."""
    velocity_time_constant: float = 0.04607
    """T of the low-pass (19) before the wheel acceleration [s]; above -dt/2."""
    euler: bool = True
    """Remove the Euler acceleration (15)."""
    centrifugal: bool = True
    """Remove the centrifugal acceleration (14)."""
    wheel: bool = True
    """Remove the acceleration of the wheels (18)-(21)."""
    yaw: bool = True
    """Remove what turning adds to an IMU off the axle, on robots with two wheel encoders."""
    dt: float = 0.0
    """Sampling period the time constants were tuned at [s]; 0 where unknown."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.dt) and self.dt >= 0.0):
            raise ConfigurationError(f"correction.dt: {self.dt} s is not a period of 0 or more")
        for name in ("rate_time_constant", "velocity_time_constant"):
            value, limit = getattr(self, name), -0.5 * self.dt
            if not math.isfinite(value) or (self.dt > 0.0 and value <= limit):
                raise ConfigurationError(
                    f"correction.{name}: {value} s is not above {limit} s (-dt/2, dt = {self.dt} s)"
                )


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything the correction needs to know: robot, calibration and settings."""

    robot: Robot = field(default_factory=Robot)
    calibration: Calibration = field(default_factory=Calibration)
    correction: CorrectionSettings = field(default_factory=CorrectionSettings)


def _numbers(value: object) -> tuple[float, ...]:
    if isinstance(value, tuple):
        return tuple(float(number) for number in value)
    return (float(value),) if isinstance(value, (int, float)) else ()


def _section(instance: object) -> str:
    return type(instance).__name__.lower()


def _require_finite(instance: Robot | Calibration) -> None:
    for entry in fields(instance):
        if not all(math.isfinite(number) for number in _numbers(getattr(instance, entry.name))):
            raise ConfigurationError(
                f"{_section(instance)}.{entry.name}: {getattr(instance, entry.name)} is not finite"
            )


def _require_positive(instance: Robot | Calibration, names: tuple[str, ...]) -> None:
    for name in names:
        if not getattr(instance, name) > 0.0:
            raise ConfigurationError(
                f"{_section(instance)}.{name}: {getattr(instance, name)} is not above 0"
            )
