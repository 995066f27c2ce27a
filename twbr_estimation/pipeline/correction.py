"""Correction of one sample: calibration, mounting and the robot's own motion.

Laddach 2022 (7)-(21) with these departures from print, each of which restores the
physics: the angle uses atan2 in (13), and (18) adds the body's turn where the encoder
sits on the body. In body axes of REP-103 the paper's a_x' is -accel_x and its a_y' is
accel_z; the rate is gyro_y.

`start` and `step` are pure functions on named tuples, so that a batch can compile them;
`Corrector` holds their state for a live stream.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..robot import POLYNOMIAL_DEGREE, Calibration, EncoderPlacement, Setup
from ..samples import RESTART_GAP, CorrectedSample, Sample

SATURATION_MARGIN = 0.999
"""A reading above this share of full scale counts as saturated."""
SATURATED_SHARE = 0.5
"""Standard deviation of a saturated reading, as a share of full scale."""
_SHORT_DEGREE = 5
_FREE_FALL = 1e-3  # below this specific force [m/s^2] there is no direction to measure

_NO_WHEEL, _WHEEL_ANGLE, _WHEEL_VELOCITY = 0.0, 1.0, 2.0


class Coefficients(NamedTuple):
    """`Setup` as the numbers a step needs, derived once."""

    gyro_bias: tuple[float, float, float]
    gyro_scale: tuple[float, float, float]
    accel_bias: tuple[float, float, float]
    accel_limits: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    polynomials: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    """Scale polynomials of x, y, z, highest power first, padded to one length."""
    rotation: tuple[float, float, float, float, float, float, float, float, float]
    """Sensor to body, row by row."""
    gyro_limit: float
    accel_limit: float
    gyro_variance: float
    accel_variance: float
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


class State(NamedTuple):
    """What the correction remembers from one sample to the next."""

    angle: float
    """Corrected angle one sample ago [rad]."""
    rate: float
    """Rate after the low-pass (16) [rad/s]."""
    velocity: float
    """Wheel velocity after the low-pass (19) [m/s]."""
    wheel_angle: float
    """Encoder angle one sample ago [rad]."""
    wheel_known: float
    """0: no wheel; 1: the angle is known; 2: the velocity is known, too."""
    wheel_difference: float
    """Right minus left encoder angle one sample ago [rad]."""
    roll_rate: float
    """Rates about the body's x and z axes after the low-pass (16); 0 without two encoders."""
    yaw_rate: float


def derive(setup: Setup) -> Coefficients:
    """Turn robot, calibration and settings into the coefficients of a step."""
    robot, calibration, settings = setup.robot, setup.calibration, setup.correction
    limits = (calibration.accel_valid_x, calibration.accel_valid_y, calibration.accel_valid_z)
    rotation = [float(number) for number in robot.rotation().ravel()]
    return Coefficients(
        gyro_bias=calibration.gyro_bias,
        gyro_scale=calibration.gyro_scale,
        accel_bias=calibration.accel_bias,
        accel_limits=limits,
        polynomials=_polynomials(calibration),
        rotation=tuple(rotation),  # type: ignore[arg-type]
        gyro_limit=SATURATION_MARGIN * robot.gyro_range,
        accel_limit=SATURATION_MARGIN * robot.accel_range,
        gyro_variance=calibration.gyro_noise**2,
        accel_variance=calibration.accel_noise**2,
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


def _scaled(
    reading: float, bias: float, limits: tuple[float, float], polynomial: tuple[float, ...]
) -> float:
    """Remove bias and scale error, Laddach 2022 (11), (12), with a clamped argument."""
    unbiased = reading - bias
    argument = min(max(unbiased, limits[0]), limits[1])
    error = 0.0
    for coefficient in polynomial:
        error = (error + coefficient) * argument
    return unbiased - error


def _variance(reading: float, limit: float, variance: float, saturated: float) -> float:
    return saturated if abs(reading) >= limit else variance


def _calibrate(sample: Sample, c: Coefficients) -> CorrectedSample:
    """Calibrate all three axes and turn them into body axes; the angle is left at zero."""
    gx = (sample.gyro_x - c.gyro_bias[0]) * c.gyro_scale[0]  # (8)
    gy = (sample.gyro_y - c.gyro_bias[1]) * c.gyro_scale[1]
    gz = (sample.gyro_z - c.gyro_bias[2]) * c.gyro_scale[2]
    ax = _scaled(sample.accel_x, c.accel_bias[0], c.accel_limits[0], c.polynomials[0])  # (11)
    ay = _scaled(sample.accel_y, c.accel_bias[1], c.accel_limits[1], c.polynomials[1])
    az = _scaled(sample.accel_z, c.accel_bias[2], c.accel_limits[2], c.polynomials[2])  # (12)
    ugx = _variance(sample.gyro_x, c.gyro_limit, c.gyro_variance, c.gyro_saturated)
    ugy = _variance(sample.gyro_y, c.gyro_limit, c.gyro_variance, c.gyro_saturated)
    ugz = _variance(sample.gyro_z, c.gyro_limit, c.gyro_variance, c.gyro_saturated)
    uax = _variance(sample.accel_x, c.accel_limit, c.accel_variance, c.accel_saturated)
    uay = _variance(sample.accel_y, c.accel_limit, c.accel_variance, c.accel_saturated)
    uaz = _variance(sample.accel_z, c.accel_limit, c.accel_variance, c.accel_saturated)
    xx, xy, xz, yx, yy, yz, zx, zy, zz = c.rotation
    return CorrectedSample(
        sample.dt,
        0.0,
        0.0,
        xx * gx + xy * gy + xz * gz,
        yx * gx + yy * gy + yz * gz,
        zx * gx + zy * gy + zz * gz,
        xx * ax + xy * ay + xz * az,
        yx * ax + yy * ay + yz * az,
        zx * ax + zy * ay + zz * az,
        xx * xx * ugx + xy * xy * ugy + xz * xz * ugz,
        yx * yx * ugx + yy * yy * ugy + yz * yz * ugz,
        zx * zx * ugx + zy * zy * ugy + zz * zz * ugz,
        xx * xx * uax + xy * xy * uay + xz * xz * uaz,
        yx * yx * uax + yy * yy * uay + yz * yz * uaz,
        zx * zx * uax + zy * zy * uay + zz * zz * uaz,
        sample.wheel_angle,
        sample.wheel_difference,
        sample.wheel_count,
        sample.voltage,
        sample.voltage_difference,
        sample.motor_count,
    )


def _with_angle(sample: CorrectedSample, back: float, up: float, last: float) -> CorrectedSample:
    """Put in the angle of (13) from gravity's share along a_x' (`back`) and a_y' (`up`)."""
    force = back * back + up * up
    angle, variance = last, math.pi**2
    if force > _FREE_FALL * _FREE_FALL:
        angle = math.atan2(back, up)  # (13)
        noise = sample.accel_variance_x * up * up + sample.accel_variance_z * back * back
        variance = min(noise / (force * force), math.pi**2)
    return CorrectedSample(
        sample.dt,
        angle,
        variance,
        sample.gyro_x,
        sample.gyro_y,
        sample.gyro_z,
        sample.accel_x,
        sample.accel_y,
        sample.accel_z,
        sample.gyro_variance_x,
        sample.gyro_variance_y,
        sample.gyro_variance_z,
        sample.accel_variance_x,
        sample.accel_variance_y,
        sample.accel_variance_z,
        sample.wheel_angle,
        sample.wheel_difference,
        sample.wheel_count,
        sample.voltage,
        sample.voltage_difference,
        sample.motor_count,
    )


def start(sample: Sample, c: Coefficients) -> tuple[State, CorrectedSample]:
    """Begin with a first sample: no motion terms, wheels at rest (Laddach 2022, section 4)."""
    body = _calibrate(sample, c)
    corrected = _with_angle(body, -body.accel_x, body.accel_z, 0.0)
    known = _WHEEL_VELOCITY if sample.wheel_count > 0.0 else _NO_WHEEL
    two = 1.0 if _turns(sample, c) else 0.0
    return State(
        corrected.angle,
        body.gyro_y,
        0.0,
        sample.wheel_angle,
        known,
        sample.wheel_difference,
        two * body.gyro_x,
        two * body.gyro_z,
    ), corrected


def _turns(sample: Sample, c: Coefficients) -> bool:
    """Return whether the terms of turning are taken out."""
    return c.yaw > 0.0 and sample.wheel_count == 2.0


def step(state: State, sample: Sample, c: Coefficients) -> tuple[State, CorrectedSample]:
    """Correct one sample, Laddach 2022 (7)-(21).

    Args:
        state: what the previous sample left.
        sample: the reading; its `dt` is above zero.
        c: the coefficients.

    Returns:
        The next state and the sample in body axes with the corrected angle.
    """
    body = _calibrate(sample, c)
    rate = (body.gyro_y * sample.dt + state.rate * c.rate_time_constant) / (
        sample.dt + c.rate_time_constant
    )  # (16)
    turn = (rate - state.rate) / sample.dt * c.euler  # (17)
    spin = body.gyro_y * body.gyro_y * c.centrifugal
    euler = turn * c.lever_up - spin * c.lever_forward  # (15)
    centrifugal = spin * c.lever_up + turn * c.lever_forward  # (14)
    velocity, known = _wheel_velocity(state, sample, body.gyro_y, c)
    forward = 0.0
    if known == _WHEEL_VELOCITY and state.wheel_known == _WHEEL_VELOCITY:
        forward = (velocity - state.velocity) / sample.dt * c.wheel  # (20)
    back = -body.accel_x + euler + forward * math.cos(state.angle)  # (21), numerator of (13)
    up = body.accel_z + centrifugal - forward * math.sin(state.angle)
    roll_rate, yaw_rate = 0.0, 0.0
    if _turns(sample, c):
        roll, yaw = _turning(state, sample, body, c)
        share, settled = sample.dt / (sample.dt + c.rate_time_constant), c.euler
        roll_rate, yaw_rate = state.roll_rate, state.yaw_rate
        if state.wheel_known == _NO_WHEEL:  # the second encoder comes in: no past to differ from
            roll_rate, yaw_rate, settled = roll, yaw, 0.0
        roll_change, yaw_change = share * (roll - roll_rate), share * (yaw - yaw_rate)
        roll_rate, yaw_rate = roll_rate + roll_change, yaw_rate + yaw_change  # (16)
        roll_turn, yaw_turn = settled * roll_change / sample.dt, settled * yaw_change / sample.dt
        forward_turn, up_turn = _felt_turning(roll, body.gyro_y, yaw, roll_turn, yaw_turn, c)
        back += forward_turn
        up -= up_turn
    corrected = _with_angle(body, back, up, state.angle)
    return State(
        corrected.angle,
        rate,
        velocity,
        sample.wheel_angle,
        known,
        sample.wheel_difference,
        roll_rate,
        yaw_rate,
    ), corrected


def _turning(
    state: State, sample: Sample, body: CorrectedSample, c: Coefficients
) -> tuple[float, float]:
    """Return the rates about the body's x and z axes; from the wheels where the gyro saturates."""
    largest = max(abs(sample.gyro_x), abs(sample.gyro_z))
    known = state.wheel_known > _NO_WHEEL and c.yaw_per_difference > 0.0
    if largest < c.gyro_limit or not known:
        return body.gyro_x, body.gyro_z
    turned = sample.wheel_difference - state.wheel_difference
    heading_rate = c.yaw_per_difference * turned / sample.dt
    return -heading_rate * math.sin(state.angle), heading_rate * math.cos(state.angle)


def _felt_turning(
    roll: float, pitch: float, yaw: float, roll_turn: float, yaw_turn: float, c: Coefficients
) -> tuple[float, float]:
    """Return what turning adds to the IMU's acceleration, forward and up [m/s^2].

    These are the terms of omega x (omega x arm) + omega' x arm that (14) and (15) have not.
    """
    x, y, z = c.lever_forward, c.lever_left, c.lever_up
    forward = roll * (pitch * y + yaw * z) - yaw * yaw * x - yaw_turn * y
    up = yaw * (roll * x + pitch * y) - roll * roll * z + roll_turn * y
    return forward, up


def _wheel_velocity(
    state: State, sample: Sample, rate: float, c: Coefficients
) -> tuple[float, float]:
    """Return the filtered velocity (18), (19) and what is known of the wheel now."""
    if sample.wheel_count == 0.0:
        return 0.0, _NO_WHEEL
    if state.wheel_known == _NO_WHEEL:
        return 0.0, _WHEEL_ANGLE
    turn = (sample.wheel_angle - state.wheel_angle) / sample.dt + c.on_body * rate
    velocity = c.wheel_radius * turn  # (18)
    if state.wheel_known == _WHEEL_ANGLE:
        return velocity, _WHEEL_VELOCITY
    weighted = velocity * sample.dt + state.velocity * c.velocity_time_constant
    return weighted / (sample.dt + c.velocity_time_constant), _WHEEL_VELOCITY  # (19)


class Corrector:
    """The correction of a live stream, one sample at a time."""

    def __init__(self, setup: Setup) -> None:
        """Start without a past; `setup` holds robot, calibration and settings."""
        self._coefficients = derive(setup)
        self._state: State | None = None

    def step(self, sample: Sample) -> CorrectedSample:
        """Return the corrected sample; a gap above `RESTART_GAP` starts afresh."""
        if self._state is None or sample.dt > RESTART_GAP:
            self._state, corrected = start(sample, self._coefficients)
        else:
            self._state, corrected = step(self._state, sample, self._coefficients)
        return corrected

    def reset(self) -> None:
        """Forget the past."""
        self._state = None

    def reconfigure(self, setup: Setup) -> None:
        """Use other coefficients from the next sample on; the past stays."""
        self._coefficients = derive(setup)
