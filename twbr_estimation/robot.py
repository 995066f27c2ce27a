"""The user's robot: geometry, sensors, mechanics and their calibration, as plain data.

The field names are the names in `robot.yaml` and `calibration.yaml` and the parameter
names of the nodes; `configuration` and the nodes derive theirs from these classes. Defaults
describe an MPU6050 on the robot of Laddach 2022.
"""

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from .errors import ConfigurationError
from .parameters.argument_checks import require_kind
from .parameters.bounds import Bounds, Meaning, require_bounds
from .plants.laddach2022 import PlantParameters

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

    wheel_radius: Annotated[float, Bounds(0.001, 1.0, "m", "Wheel radius.")] = 0.0375
    track_width: Annotated[
        float, Bounds(0.0, 5.0, "m", "Distance between the wheels; 0 where unknown.")
    ] = 0.0
    encoder_placement: Annotated[
        EncoderPlacement,
        Meaning("Whether the encoder counts against the body or against the ground."),
    ] = EncoderPlacement.BODY
    lever_arm: Annotated[
        tuple[float, float, float],
        Bounds(
            -2.0,
            2.0,
            "m",
            "Position of the IMU relative to the middle of the wheel axle, body axes.",
        ),
    ] = (0.0, 0.0, 0.135)
    mounting: Annotated[
        tuple[float, float, float],
        Bounds(
            -2.0 * math.pi,
            2.0 * math.pi,
            "rad",
            "Roll, pitch, yaw of the sensor in the body, fixed axes as in URDF.",
        ),
    ] = (0.0, 0.0, 0.0)
    gyro_range: Annotated[
        float,
        Bounds(
            0.1,
            200.0,
            "rad/s",
            "Full scale of the gyro; readings at it are saturated. The default is the paper's "
            "250 deg/s; that of `mpu6050_node` is 1000 deg/s.",
        ),
    ] = math.radians(250.0)
    accel_range: Annotated[
        float,
        Bounds(
            1.0,
            2000.0,
            "m/s^2",
            "Full scale of the accelerometer. The default is the paper's 2 g; that of "
            "`mpu6050_node` is 8 g.",
        ),
    ] = 2.0 * 9.80665
    gyro_delay: Annotated[
        float,
        Bounds(
            0.0,
            LONGEST_DELAY,
            "s",
            "How much the gyro's low-pass lags behind the motion; the MPU6050's without filter.",
        ),
    ] = 0.00098
    body_mass: Annotated[
        float, Bounds(0.001, 500.0, "kg", "Mass of the body without the wheels.")
    ] = 1.0
    body_height: Annotated[
        float,
        Bounds(
            -3.0, 3.0, "m", "Height of the body's centre of mass above the axle; below 0 it hangs."
        ),
    ] = 0.09
    body_inertia: Annotated[
        float,
        Bounds(
            1e-08,
            500.0,
            "kg m^2",
            "Moment of inertia of the body about its centre of mass, pitch axis.",
        ),
    ] = 0.0045
    body_inertia_roll: Annotated[
        float,
        Bounds(
            1e-08,
            500.0,
            "kg m^2",
            "Moment of inertia of the body about its centre of mass, roll axis.",
        ),
    ] = 0.006
    body_inertia_yaw: Annotated[
        float,
        Bounds(
            1e-08,
            500.0,
            "kg m^2",
            "Moment of inertia of the body about its centre of mass, yaw axis.",
        ),
    ] = 0.002
    wheel_mass: Annotated[float, Bounds(0.0001, 100.0, "kg", "Mass of one wheel.")] = 0.06
    wheel_inertia: Annotated[
        float, Bounds(1e-09, 50.0, "kg m^2", "Moment of inertia of one wheel about the axle.")
    ] = 5e-5
    wheel_inertia_across: Annotated[
        float, Bounds(1e-09, 50.0, "kg m^2", "Moment of inertia of one wheel about a diameter.")
    ] = 2.5e-5
    gear_ratio: Annotated[
        float, Bounds(0.01, 1000.0, "1", "Turns of a motor in one turn of its wheel.")
    ] = 30.0
    winding_resistance: Annotated[
        float, Bounds(0.001, 1000.0, "ohm", "Resistance of one motor's winding.")
    ] = 2.2
    torque_constant: Annotated[
        float, Bounds(1e-05, 10.0, "N m/A", "Torque of one motor per current, before the gear.")
    ] = 0.0083
    back_emf_constant: Annotated[
        float,
        Bounds(1e-05, 10.0, "V s/rad", "Voltage that one motor induces per rate, before the gear."),
    ] = 0.0112
    supply_voltage: Annotated[float, Bounds(0.1, 1000.0, "V", "Largest voltage at a motor.")] = 12.0

    def __post_init__(self) -> None:
        require_bounds(self, "robot.")

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

    gyro_bias: Annotated[
        tuple[float, float, float], Bounds(-10.0, 10.0, "rad/s", "Gyro readings at rest.")
    ] = (0.0, 0.0, 0.0)
    gyro_bias_slope: Annotated[
        tuple[float, float, float],
        Bounds(
            -0.1,
            0.1,
            "rad/s/K",
            "Change of the gyro readings at rest with the sensor's temperature; used where the "
            "temperature comes.",
        ),
    ] = (0.0, 0.0, 0.0)
    gyro_bias_temperature: Annotated[
        float, Bounds(-100.0, 200.0, "degC", "Temperature at which `gyro_bias` holds.")
    ] = 25.0
    gyro_scale: Annotated[
        tuple[float, float, float],
        Bounds(
            0.1,
            10.0,
            "1",
            "True rate divided by measured rate, an extension of (8); 1 as in the paper.",
        ),
    ] = (1.0, 1.0, 1.0)
    accel_bias: Annotated[
        tuple[float, float, float], Bounds(-20.0, 20.0, "m/s^2", "Accelerometer biases.")
    ] = (0.0, 0.0, 0.0)
    accel_scale_x: Annotated[
        tuple[float, ...],
        Bounds(
            -100.0,
            100.0,
            "(m/s^2)^-k",
            "Coefficients of the scale polynomial of the x axis, from the first degree up; "
            "the k-th, from 0, has this unit.",
        ),
    ] = ()
    accel_scale_y: Annotated[
        tuple[float, ...],
        Bounds(
            -100.0,
            100.0,
            "(m/s^2)^-k",
            "Coefficients of the scale polynomial of the y axis, from the first degree up; "
            "the k-th, from 0, has this unit.",
        ),
    ] = ()
    accel_scale_z: Annotated[
        tuple[float, ...],
        Bounds(
            -100.0,
            100.0,
            "(m/s^2)^-k",
            "Coefficients of the scale polynomial of the z axis, from the first degree up; "
            "the k-th, from 0, has this unit.",
        ),
    ] = ()
    accel_valid_x: Annotated[
        tuple[float, float],
        Bounds(
            -2000.0,
            2000.0,
            "m/s^2",
            "Range of the polynomial's argument on the x axis; beyond it the argument is clamped.",
        ),
    ] = (-9.9, 9.9)
    accel_valid_y: Annotated[
        tuple[float, float],
        Bounds(
            -2000.0,
            2000.0,
            "m/s^2",
            "Range of the polynomial's argument on the y axis; beyond it the argument is clamped.",
        ),
    ] = (-9.9, 9.9)
    accel_valid_z: Annotated[
        tuple[float, float],
        Bounds(
            -2000.0,
            2000.0,
            "m/s^2",
            "Range of the polynomial's argument on the z axis; beyond it the argument is clamped.",
        ),
    ] = (-2.0, 10.2)
    gyro_noise: Annotated[
        float, Bounds(1e-08, 1.0, "rad/s", "Standard deviation of one gyro reading.")
    ] = math.radians(0.1)
    accel_noise: Annotated[
        float, Bounds(1e-06, 3.0, "m/s^2", "Standard deviation of one accelerometer reading.")
    ] = 0.04

    def __post_init__(self) -> None:
        require_bounds(self, "calibration.")
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


LONGEST_PERIOD = 0.1
"""Sampling period [s] that a negative time constant is checked against where none is known."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """Which motion terms are removed, and how strongly their inputs are smoothed.

    Raises:
        ConfigurationError: a time constant at which its low-pass is unstable.
    """

    rate_time_constant: Annotated[
        float,
        Bounds(
            -1.0, 10.0, "s", "T of the low-pass (16) before the angular acceleration; above -dt/2."
        ),
    ] = 0.06874
    velocity_time_constant: Annotated[
        float,
        Bounds(
            -1.0, 10.0, "s", "T of the low-pass (19) before the wheel acceleration; above -dt/2."
        ),
    ] = 0.04607
    euler: Annotated[bool, Meaning("Remove the Euler acceleration (15).")] = True
    centrifugal: Annotated[bool, Meaning("Remove the centrifugal acceleration (14).")] = True
    wheel: Annotated[bool, Meaning("Remove the acceleration of the wheels (18)-(21).")] = True
    yaw: Annotated[
        bool,
        Meaning(
            "Remove what turning adds to an IMU off the axle, on robots with two wheel encoders."
        ),
    ] = True
    dt: Annotated[
        float,
        Bounds(
            0.0, 10.0, "s", "Sampling period the time constants were tuned at; 0 where unknown."
        ),
    ] = 0.0

    def __post_init__(self) -> None:
        require_bounds(self, "correction.")
        for name in ("rate_time_constant", "velocity_time_constant"):
            period = self.dt or LONGEST_PERIOD
            value, limit = getattr(self, name), -0.5 * period
            if value <= limit:
                raise ConfigurationError(
                    f"correction.{name}: {value} s is not above {limit} s (-dt/2, dt = {period} s)"
                )


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything the correction depends on: robot, calibration and settings.

    Raises:
        ConfigurationError: a part of another type.
    """

    robot: Robot = field(default_factory=Robot)
    calibration: Calibration = field(default_factory=Calibration)
    correction: CorrectionSettings = field(default_factory=CorrectionSettings)

    def __post_init__(self) -> None:
        require_kind("robot", self.robot, Robot, "a Robot")
        require_kind("calibration", self.calibration, Calibration, "a Calibration")
        require_kind("correction", self.correction, CorrectionSettings, "CorrectionSettings")
