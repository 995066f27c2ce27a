"""Robot, calibration and settings as the numbers that a step of the correction needs."""

from typing import NamedTuple

from ..robot import POLYNOMIAL_DEGREE, Calibration, EncoderPlacement, Robot, Setup
from .saturation import ACCEL_MARK, GYRO_MARK, SATURATED_SHARE, SATURATION_MARGIN, marked

Rotation = tuple[float, float, float, float, float, float, float, float, float]
"""Rows of a rotation matrix, one after the other."""
Vector = tuple[float, float, float]
_SHORT_DEGREE = 5


class Coefficients(NamedTuple):
    """`Setup` as the numbers a step needs, derived once."""

    gyro_bias: tuple[float, float, float]
    gyro_scale: tuple[float, float, float]
    accel_bias: tuple[float, float, float]
    accel_limits: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    polynomials: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    """Scale polynomials of x, y, z, highest power first, padded to one length."""
    rotation: Rotation
    """Sensor to body, row by row."""
    gyro_limit: float
    accel_limit: float
    gyro_variance: float
    accel_variance: float
    gyro_ordinary: Vector
    """Variances in body axes while no axis is saturated."""
    accel_ordinary: Vector
    gyro_saturated: float
    """Variance of a saturated gyro reading [(rad/s)^2]."""
    accel_saturated: float
    """Variance of a saturated accelerometer reading [(m/s^2)^2]."""
    lever_forward: float
    lever_up: float
    wheel_radius: float
    on_body: float
    rate_time_constant: float
    velocity_time_constant: float
    euler: float
    centrifugal: float
    wheel: float
    yaw: float
    lever_left: float
    yaw_per_difference: float
    """Yaw rate per difference of the wheels' rates; 0 where the track width is unknown."""


def derive(setup: Setup) -> Coefficients:
    """Turn robot, calibration and settings into the coefficients of a step."""
    robot, calibration, settings = setup.robot, setup.calibration, setup.correction
    limits = (calibration.accel_valid_x, calibration.accel_valid_y, calibration.accel_valid_z)
    rotation = _rotation(robot)
    gyro_variance, accel_variance = calibration.gyro_noise**2, calibration.accel_noise**2
    return Coefficients(
        gyro_bias=calibration.gyro_bias,
        gyro_scale=calibration.gyro_scale,
        accel_bias=calibration.accel_bias,
        accel_limits=limits,
        polynomials=_polynomials(calibration),
        rotation=rotation,
        gyro_limit=SATURATION_MARGIN * robot.gyro_range,
        accel_limit=SATURATION_MARGIN * robot.accel_range,
        gyro_variance=gyro_variance,
        accel_variance=accel_variance,
        gyro_ordinary=_ordinary(rotation, gyro_variance, GYRO_MARK),
        accel_ordinary=_ordinary(rotation, accel_variance, ACCEL_MARK),
        gyro_saturated=(SATURATED_SHARE * robot.gyro_range) ** 2,
        accel_saturated=(SATURATED_SHARE * robot.accel_range) ** 2,
        lever_forward=robot.lever_arm[0],
        lever_up=robot.lever_arm[2],
        wheel_radius=robot.wheel_radius,
        on_body=float(robot.encoder_placement is EncoderPlacement.BODY),
        rate_time_constant=settings.rate_time_constant,
        velocity_time_constant=settings.velocity_time_constant,
        euler=float(settings.euler),
        centrifugal=float(settings.centrifugal),
        wheel=float(settings.wheel),
        yaw=float(settings.yaw),
        lever_left=robot.lever_arm[1],
        yaw_per_difference=robot.wheel_radius / robot.track_width if robot.track_width else 0.0,
    )


def _rotation(robot: Robot) -> Rotation:
    a, b, c, d, e, f, g, h, i = (float(number) for number in robot.rotation().ravel())
    return a, b, c, d, e, f, g, h, i


def spread(r: Rotation, x: float, y: float, z: float) -> Vector:
    """Turn variances of sensor axes into those of body axes."""
    return (
        r[0] * r[0] * x + r[1] * r[1] * y + r[2] * r[2] * z,
        r[3] * r[3] * x + r[4] * r[4] * y + r[5] * r[5] * z,
        r[6] * r[6] * x + r[7] * r[7] * y + r[8] * r[8] * z,
    )


def _ordinary(r: Rotation, variance: float, mark: float) -> Vector:
    """Return the variances in body axes while no axis is saturated."""
    x, y, z = spread(r, variance, variance, variance)
    return marked(x, 0.0, mark), marked(y, 0.0, mark), marked(z, 0.0, mark)


def _polynomials(
    calibration: Calibration,
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    x, y, z = calibration.accel_scale_x, calibration.accel_scale_y, calibration.accel_scale_z
    length = _SHORT_DEGREE
    if max(len(x), len(y), len(z)) > _SHORT_DEGREE:
        length = POLYNOMIAL_DEGREE
    return _padded(x, length), _padded(y, length), _padded(z, length)


def _padded(polynomial: tuple[float, ...], length: int) -> tuple[float, ...]:
    ascending = polynomial + (0.0,) * (length - len(polynomial))
    return tuple(float(number) for number in reversed(ascending))
