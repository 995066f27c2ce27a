"""Correction of one sample: calibration, mounting and the robot's own motion.

Laddach 2022 (7)-(21) with these departures from print, each of which restores the
physics: the angle uses atan2 in (13), and (18) adds the body's turn where the encoder
sits on the body. In body axes of REP-103 the paper's a_x' is -accel_x and its a_y' is
accel_z; the rate is gyro_y.

`start` and `step` are pure functions on named tuples, so that a batch can compile them;
`Corrector` holds their state for a live stream.
"""

import math
from typing import Any, NamedTuple

from ..robot import Setup
from ..samples import (
    FASTEST_WHEEL,
    RESTART_GAP,
    CorrectedSample,
    Sample,
    is_silent,
    is_weightless,
    wrapped,
)
from .calibrated import calibrated_force, calibrated_rate, doubt
from .coefficients import Coefficients, Vector, derive
from .saturation import ACCEL_MARK, GYRO_MARK
from .step_code import StepCode

_FREE_FALL = 1e-3  # below this specific force [m/s^2] there is no direction to measure

LARGEST_STEP, COARSEST = 8.0, 0.06
"""Largest jump of the wheels' acceleration that one step of the encoder may make [m/s^2], and the
longest time over which the acceleration of a coarser encoder is averaged so that it makes no larger
one [s]. Where more time is needed, the acceleration is left out."""
BRIEF = 0.05
"""Longest time in which one step of an encoder changes the angle [s]: the samples between two
readings share it. A robot that sets off changes the angle for longer."""
STEP_GROWTH, STEP_SHARE, FINEST_STEP = 2.0, 0.3, 1e-3
"""By which factor a larger step may raise the estimate of the step at once, by which share a
smaller one lowers it, and the smallest estimate that is raised [rad]."""
_STANDS = 1e-9  # smallest change of an encoder angle [rad]
_NO_WHEEL, _WHEEL_ANGLE, _WHEEL_VELOCITY = 0.0, 1.0, 2.0


class State(NamedTuple):
    """State of the correction between two samples."""

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
    moving: float
    """Time since the encoder angle last stood [s]."""
    set_off: float
    """Its first change after that [rad]."""
    step: float
    """The change that one step of an encoder makes in a sample [rad]; 0 until seen."""
    forward: float
    """The wheels' acceleration (20), averaged where the encoder is coarse [m/s^2]."""


def _corrected(
    sample: Sample,
    gyro: Vector,
    accel: Vector,
    back: float,
    up: float,
    last: float,
    c: Coefficients,
) -> CorrectedSample:
    """Return the sample with the angle of (13) from gravity's share along a_x' and a_y'.

    Args:
        sample: The reading.
        gyro: Calibrated rate, body axes [rad/s].
        accel: Calibrated specific force, body axes [m/s^2].
        back: Gravity's share along a_x' [m/s^2].
        up: The same along a_y'.
        last: Angle by the gyro alone [rad], where the accelerometer shows none.
        c: The coefficients.
    """
    gyro_limit, accel_limit = c.gyro_limit, c.accel_limit
    if is_weightless(sample):
        accel_limit = back = up = 0.0
    if is_silent(sample):
        gyro_limit = 0.0
    rates, rates_saturated = doubt(
        (sample.gyro_x, sample.gyro_y, sample.gyro_z),
        gyro_limit,
        c.gyro_ordinary,
        c.gyro_variance,
        c.gyro_saturated,
        GYRO_MARK,
        c.rotation,
    )
    forces, forces_saturated = doubt(
        (sample.accel_x, sample.accel_y, sample.accel_z),
        accel_limit,
        c.accel_ordinary,
        c.accel_variance,
        c.accel_saturated,
        ACCEL_MARK,
        c.rotation,
    )
    force = back * back + up * up
    angle, variance = last, math.pi**2
    if force > _FREE_FALL * _FREE_FALL:
        angle = math.atan2(back, up)  # (13)
        noise = forces[0] * up * up + forces[2] * back * back
        variance = min(noise / (force * force), math.pi**2)
    return CorrectedSample(  # by place, which the interpreter does in half the time
        sample.dt,
        angle,
        variance,
        gyro[0],
        gyro[1],
        gyro[2],
        accel[0],
        accel[1],
        accel[2],
        rates[0],
        rates[1],
        rates[2],
        forces[0],
        forces[1],
        forces[2],
        sample.wheel_angle,
        sample.wheel_difference,
        sample.wheel_count,
        sample.voltage,
        sample.voltage_difference,
        sample.motor_count,
        rates_saturated[0],
        rates_saturated[1],
        rates_saturated[2],
        forces_saturated[0],
        forces_saturated[1],
        forces_saturated[2],
    )


def start(sample: Sample, c: Coefficients) -> tuple[State, CorrectedSample]:
    """Begin with a first sample: no motion terms, wheels at rest (Laddach 2022, section 4)."""
    gyro, accel = calibrated_rate(sample, c), calibrated_force(sample, c)
    corrected = _corrected(sample, gyro, accel, -accel[0], accel[2], 0.0, c)
    known = _WHEEL_VELOCITY if sample.wheel_count > 0.0 else _NO_WHEEL
    two = 1.0 if _turns(sample, c) else 0.0
    return State(
        corrected.angle,
        gyro[1],
        0.0,
        sample.wheel_angle,
        known,
        sample.wheel_difference,
        two * gyro[0],
        two * gyro[2],
        2.0 * BRIEF,
        0.0,
        0.0,
        0.0,
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
    gyro, accel = calibrated_rate(sample, c), calibrated_force(sample, c)
    dt, pitch_rate, constant = sample.dt, gyro[1], c.rate_time_constant
    if is_silent(sample):
        pitch_rate = state.rate  # else its return would look like an angular acceleration
    rate = (pitch_rate * dt + state.rate * constant) / (dt + constant)  # (16)
    turn = (rate - state.rate) / dt * c.euler  # (17)
    spin = pitch_rate * pitch_rate * c.centrifugal
    arm_up, arm_forward = c.lever_up, c.lever_forward
    euler = turn * arm_up - spin * arm_forward  # (15)
    centrifugal = spin * arm_up + turn * arm_forward  # (14)
    velocity, known = _wheel_velocity(state, sample, pitch_rate, c)
    forward, moving, set_off, one_step = 0.0, 2.0 * BRIEF, 0.0, state.step
    if known == _WHEEL_VELOCITY and state.wheel_known == _WHEEL_VELOCITY:
        moving, set_off, one_step = _encoder_step(state, sample)
        forward = (velocity - state.velocity) / dt * c.wheel  # (20)
        passed = dt + max(c.velocity_time_constant, 0.0)  # by the low-pass
        needed = c.wheel_radius * one_step / LARGEST_STEP / passed
        if needed > COARSEST:
            forward = 0.0
        elif needed > dt:
            forward = state.forward + dt / needed * (forward - state.forward)
    back = -accel[0] + euler + forward * math.cos(state.angle)  # (21), numerator of (13)
    up = accel[2] + centrifugal - forward * math.sin(state.angle)
    roll_rate, yaw_rate = 0.0, 0.0
    if _turns(sample, c):
        roll, yaw = _turning(state, sample, gyro, c)
        share, settled = dt / (dt + constant), c.euler
        roll_rate, yaw_rate = state.roll_rate, state.yaw_rate
        if state.wheel_known == _NO_WHEEL:  # the second encoder comes in: no past to differ from
            roll_rate, yaw_rate, settled = roll, yaw, 0.0
        roll_change, yaw_change = share * (roll - roll_rate), share * (yaw - yaw_rate)
        roll_rate, yaw_rate = roll_rate + roll_change, yaw_rate + yaw_change  # (16)
        roll_turn, yaw_turn = settled * roll_change / dt, settled * yaw_change / dt
        forward_turn, up_turn = turning_acceleration(roll, pitch_rate, yaw, roll_turn, yaw_turn, c)
        back += forward_turn
        up -= up_turn
    corrected = _corrected(sample, gyro, accel, back, up, wrapped(state.angle + dt * gyro[1]), c)
    return State(
        corrected.angle,
        rate,
        velocity,
        sample.wheel_angle,
        known,
        sample.wheel_difference,
        roll_rate,
        yaw_rate,
        moving,
        set_off,
        one_step,
        forward,
    ), corrected


def _turning(state: State, sample: Sample, gyro: Vector, c: Coefficients) -> tuple[float, float]:
    """Return the rates about the body's x and z axes; from the wheels where the gyro saturates."""
    largest = max(abs(sample.gyro_x), abs(sample.gyro_z))
    known = state.wheel_known > _NO_WHEEL and c.yaw_per_difference > 0.0
    if largest < c.gyro_limit or not known:
        return gyro[0], gyro[2]
    turned = sample.wheel_difference - state.wheel_difference
    heading_rate = c.yaw_per_difference * turned / sample.dt
    return -heading_rate * math.sin(state.angle), heading_rate * math.cos(state.angle)


def turning_acceleration(
    roll: float, pitch: float, yaw: float, roll_turn: float, yaw_turn: float, c: Coefficients
) -> tuple[float, float]:
    """Return what turning adds to the IMU's acceleration, forward and up [m/s^2].

    These are the terms of omega x (omega x arm) + omega' x arm that (14) and (15) have not.
    """
    x, y, z = c.lever_forward, c.lever_left, c.lever_up
    forward = roll * (pitch * y + yaw * z) - yaw * yaw * x - yaw_turn * y
    up = yaw * (roll * x + pitch * y) - roll * roll * z + roll_turn * y
    return forward, up


def _encoder_step(state: State, sample: Sample) -> tuple[float, float, float]:
    """Return `moving`, `set_off` and `step` of the next state, the encoder being known before.

    The angle of a fine encoder stands where the wheel does, that of a coarse one between steps.
    """
    size = abs(sample.wheel_angle - state.wheel_angle)
    if size > _STANDS:
        set_off = size if state.moving == 0.0 else state.set_off
        return state.moving + sample.dt, set_off, state.step
    found, size = state.step, state.set_off
    if 0.0 < state.moving <= BRIEF:
        if size > found:
            found = min(size, STEP_GROWTH * max(found, FINEST_STEP))
        else:
            found += STEP_SHARE * (size - found)
    return 0.0, 0.0, found


def _wheel_velocity(
    state: State, sample: Sample, rate: float, c: Coefficients
) -> tuple[float, float]:
    """Return the filtered velocity (18), (19) and what is known of the wheel now."""
    if sample.wheel_count == 0.0:
        return 0.0, _NO_WHEEL
    if state.wheel_known == _NO_WHEEL:
        return 0.0, _WHEEL_ANGLE
    turn = (sample.wheel_angle - state.wheel_angle) / sample.dt + c.on_body * rate
    if abs(turn) > FASTEST_WHEEL:
        return state.velocity, state.wheel_known
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
        self._code: StepCode | None = None
        self._in_code = False

    def use(self, code: StepCode | None) -> None:
        """Correct by machine code from the next sample on, or interpreted again; same numbers."""
        self._leave()
        self._code = code

    def step(self, sample: Sample) -> CorrectedSample:
        """Return the corrected sample; a gap above `RESTART_GAP` starts afresh."""
        if self._in_code and sample.dt <= RESTART_GAP:
            return CorrectedSample(*self._code.step(sample))  # type: ignore[union-attr]
        if self._state is None or sample.dt > RESTART_GAP:
            self._in_code = False
            self._state, corrected = start(sample, self._coefficients)
        else:
            self._state, corrected = step(self._state, sample, self._coefficients)
        if self._code is not None:
            self._in_code = self._code.begin(self._coefficients, self._state)
        return corrected

    def reset(self) -> None:
        """Forget the past."""
        self._state, self._in_code = None, False

    def reconfigure(self, setup: Setup) -> None:
        """Use other coefficients from the next sample on; the past stays."""
        self._leave()
        self._coefficients = derive(setup)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy goes on from: interpreted, with the same numbers."""
        return {**self.__dict__, "_state": self._looked_at(), "_code": None, "_in_code": False}

    def _leave(self) -> None:
        """Take the state back from the machine code."""
        self._state, self._in_code = self._looked_at(), False

    def _looked_at(self) -> State | None:
        """Return the state; where it lies with the machine code, it stays there."""
        return self._state if self._code is None or not self._in_code else self._code.state()
