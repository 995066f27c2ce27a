"""Model of the rig for the Cramer-Rao bound: known and unknown quantities, and measurements.

Gyro and accelerometer are inputs: the bound is conditional on their readings, and holds for
every estimator without knowledge of the motors and of the forces on the robot. States are the
tilt, the sensor's velocity and distance, and every error of the readings that is observable in
a whole recording. Effects that only raise the bound are left out: the motion between two
samples, the encoder's count as anything but white noise, slips, the shaking that the motors'
voltage and impacts cause, and the gyro's sensitivity to acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from twbr_estimation.batch import CorrectedTrack
from twbr_estimation.errors import ConfigurationError
from twbr_estimation.filters.inertial.aiding import EXCESS_SPREAD, EXCESS_TIME
from twbr_estimation.filters.inertial.navigation import SHOCK
from twbr_estimation.filters.inertial.restart import FIRST_VELOCITY
from twbr_estimation.filters.ins_odometer import FIRST_TILT
from twbr_estimation.recording import FloatArray
from twbr_estimation.simulation.disturbances import (
    BUMP_CUTOFF,
    DRIFT_SECONDS,
    STEP,
    VIBRATION_DAMPING,
    VIBRATION_FREQUENCIES,
)
from twbr_estimation.simulation.planar_sensing import RESIDUAL_RMS
from twbr_estimation.simulation.rig import BUMP_LEVEL, VIBRATION_LEVEL
from twbr_estimation.simulation.simulate import WHEEL_COUNTS, Simulated

from .recursion import CramerRao, Jacobians, cramer_rao_of

TILT, VELOCITY, DISTANCE, GYRO_BIAS, GYRO_GAIN, EXCESS = range(6)
RISE, LIFT, BUMP = 6, 7, 8
"""Vertical velocity of the sensor and of the axle, and the road's bumps at unit level."""
SHAKE_FORWARD, SHAKE_UP = 9, 13
"""Two resonances of two states each, at unit level."""
MOUNTING, ARM, RADIUS, RESIDUAL = 17, 18, 19, 20
"""Constants: errors of mounting, lever arm and wheel radius, and the shape of the residual."""
STATES = 28
RISE_NOISE = 1e-4
"""Standard deviation with which the vertical velocity agrees with the motion [m/s]."""
SMOOTHING = 0.02
"""Time over which the axle's speed is taken from its encoder, for levels only [s]."""


def bound(simulated: Simulated) -> CramerRao:
    """Return the bounds of the tilt [rad^2], one a sample from the second on.

    Args:
        simulated: a recording of a world in the plane, with its truth.

    Raises:
        ConfigurationError: another recording.
    """
    return cramer_rao_of(_first(simulated), _steps(simulated), TILT)


def _first(simulated: Simulated) -> FloatArray:
    """Return what is known before the drive: the world's own spreads, the filter's start."""
    world = simulated.world
    deviation = np.zeros(STATES)
    deviation[TILT], deviation[VELOCITY], deviation[DISTANCE] = FIRST_TILT, FIRST_VELOCITY, 1.0
    deviation[GYRO_BIAS] = math.radians(world.gyro_drift_deg)
    deviation[GYRO_GAIN] = abs(world.gyro_scale_error)
    deviation[BUMP] = 1.0
    share = math.sqrt(1.0 / len(VIBRATION_FREQUENCIES))
    deviation[SHAKE_FORWARD : SHAKE_UP + 4] = share
    deviation[MOUNTING] = math.radians(world.mounting_error_deg)
    deviation[ARM] = world.lever_arm_error
    deviation[RADIUS] = world.wheel_radius_error
    # A wave of random phase: its sine and cosine parts have half the square of its size each.
    size = world.calibration_residual / RESIDUAL_RMS * math.sqrt(0.5)
    deviation[RESIDUAL:] = size
    first = np.diag(deviation**2)
    for begin in (SHAKE_FORWARD, SHAKE_UP):
        for index, frequency in enumerate(VIBRATION_FREQUENCIES):
            i = begin + 2 * index
            a, b = _resonance(frequency)
            first[i, i + 1] = first[i + 1, i] = share**2 * a / (1.0 - b)
    return first


def _steps(simulated: Simulated) -> Iterator[Jacobians]:
    recording, world, setup = simulated.recording, simulated.world, simulated.setup
    truth = recording.truth
    if truth is None or truth.rate is None or recording.wheels is None or world.track_width > 0.0:
        raise ConfigurationError(
            f"{recording.source}: the bound is for drives in the plane, with truth and wheels"
        )
    corrected = simulated.drive.corrected
    dt, radius, arm = recording.dt, setup.robot.wheel_radius, setup.robot.lever_arm[2]
    travel = radius * (recording.wheels.angle[:, 0] + truth.tilt)
    speed = _speed(travel, dt)
    noises = _Noises(simulated, dt)
    count = 2.0 * math.pi * radius / WHEEL_COUNTS
    saturated = False
    for k in range(1, truth.tilt.size):
        before, saturated = (
            saturated,
            bool(_field(corrected, "gyro_saturated_y", k)),
        )
        f, q = noises.step(corrected, float(truth.tilt[k]), float(speed[k]), saturated, before, k)
        sine, cosine = math.sin(truth.tilt[k]), math.cos(truth.tilt[k])
        h = np.zeros((2, STATES))
        h[0, TILT], h[0, DISTANCE] = -(arm * cosine + radius), 1.0
        h[0, ARM], h[0, RADIUS] = -sine, -(travel[k] - travel[0])
        rate, reading = float(truth.rate[k]), _field(corrected, "gyro_y", k)
        h[1, RISE], h[1, LIFT], h[1, TILT] = 1.0, -1.0, arm * rate * cosine
        h[1, GYRO_BIAS], h[1, GYRO_GAIN] = -arm * sine, arm * sine * reading
        h[1, ARM] = rate * sine
        noise = arm * sine * math.radians(world.gyro_noise_deg)
        r = np.array([count * count / 12.0, RISE_NOISE**2 + noise * noise])
        seen = 1 if saturated else 2
        yield Jacobians(f, q, h[:seen], r[:seen])


def _speed(travel: FloatArray, dt: float) -> FloatArray:
    width = max(round(SMOOTHING / dt), 1)
    speed = np.gradient(travel, dt)
    return np.abs(np.convolve(speed, np.full(width, 1.0 / width), "same"))


def _field(corrected: CorrectedTrack, name: str, k: int) -> float:
    return float(corrected.field(name)[k])


class _Noises:
    """Transition and process noise of one step."""

    def __init__(self, simulated: Simulated, dt: float) -> None:
        self.world, self.dt = simulated.world, dt
        shake, noise = _shaking(round(dt / STEP))
        bias, bump = math.exp(-dt / DRIFT_SECONDS), math.exp(-2.0 * math.pi * BUMP_CUTOFF * dt)
        self.f, self.q = np.eye(STATES), np.zeros((STATES, STATES))
        for begin in (SHAKE_FORWARD, SHAKE_UP):
            self.f[begin : begin + 4, begin : begin + 4] = shake
            self.q[begin : begin + 4, begin : begin + 4] = noise
        self.f[TILT, GYRO_BIAS], self.f[DISTANCE, VELOCITY] = -dt, dt
        self.f[GYRO_BIAS, GYRO_BIAS], self.f[BUMP, BUMP] = bias, bump
        drift = math.radians(self.world.gyro_drift_deg) ** 2
        self.q[GYRO_BIAS, GYRO_BIAS] = drift * (1.0 - bias * bias)
        self.q[BUMP, BUMP] = 1.0 - bump * bump

    def step(
        self,
        corrected: CorrectedTrack,
        tilt: float,
        speed: float,
        saturated: bool,
        before: bool,
        k: int,
    ) -> tuple[FloatArray, FloatArray]:
        """Return slopes and noise of the step to sample `k`.

        Args:
            corrected: the readings.
            tilt: true tilt [rad].
            speed: of the axle [m/s].
            saturated: whether the gyro is.
            before: whether it was at the sample before.
            k: number of the sample.
        """
        f, q, dt = self.f.copy(), self.q.copy(), self.dt
        f[TILT, GYRO_GAIN] = dt * _field(corrected, "gyro_y", k)
        q[TILT, TILT] = (dt * math.radians(self.world.gyro_noise_deg)) ** 2
        f[LIFT, BUMP] = dt * BUMP_LEVEL * speed * self.world.vibration
        _exceed(f, q, dt, saturated, before)
        force = np.array([_field(corrected, "accel_x", k), _field(corrected, "accel_z", k)])
        sine, cosine = math.sin(tilt), math.cos(tilt)
        turn = dt * np.array([[cosine, sine], [-sine, cosine]])
        ahead, up = turn @ force
        rows = [VELOCITY, RISE]
        for angle in (TILT, MOUNTING):
            f[VELOCITY, angle], f[RISE, angle] = up, -ahead
        level = VIBRATION_LEVEL * self.world.vibration * (0.05 + speed / 0.5)
        for axis, begin in enumerate((SHAKE_FORWARD, SHAKE_UP)):
            f[rows, begin] = f[rows, begin + 2] = -level * turn[:, axis]
            f[rows, RESIDUAL + 4 * axis : RESIDUAL + 4 * axis + 4] = np.outer(
                -turn[:, axis], _waves(float(force[axis]))
            )
        noise = np.array([self.world.accel_noise[0], self.world.accel_noise[2]])
        q[np.ix_(rows, rows)] = (turn * noise**2) @ turn.T
        if any(_field(corrected, f"accel_saturated_{axis}", k) for axis in "xz"):
            q[rows, rows] += SHOCK * SHOCK
        return f, q


def _exceed(f: FloatArray, q: FloatArray, dt: float, saturated: bool, before: bool) -> None:
    """Let the rate exceed the gyro's range while it is saturated, as the filter has it."""
    f[EXCESS, EXCESS] = 0.0
    if not saturated:
        return
    keep = math.exp(-dt / EXCESS_TIME) if before else 0.0
    spread = EXCESS_SPREAD * EXCESS_SPREAD * (1.0 - keep * keep)
    f[EXCESS, EXCESS], f[TILT, EXCESS] = keep, dt * keep
    q[EXCESS, EXCESS] = spread
    q[TILT, TILT] += dt * dt * spread
    q[TILT, EXCESS] = q[EXCESS, TILT] = dt * spread


def _waves(force: float) -> FloatArray:
    """Return the residual's waves at a reading [m/s^2], of unit amplitude, (4,)."""
    long, short = 0.6 * force, 1.5 * force
    return np.array(
        [
            math.sin(long),
            math.cos(long) - 1.0,
            0.6 * math.sin(short),
            0.6 * (math.cos(short) - 1.0),
        ]
    )


def _resonance(frequency: float) -> tuple[float, float]:
    """Return a and b of x(n) = a x(n-1) + b x(n-2) + noise, one step of the rig apart."""
    turn = 2.0 * math.pi * frequency * STEP
    decay = math.exp(-VIBRATION_DAMPING * turn)
    return 2.0 * decay * math.cos(turn), -decay * decay


def _shaking(every: int) -> tuple[FloatArray, FloatArray]:
    """Return how the resonances go on over `every` steps of the rig, and their noise, (4, 4)."""
    f, q = np.zeros((4, 4)), np.zeros((4, 4))
    for index, frequency in enumerate(VIBRATION_FREQUENCIES):
        i, (a, b) = 2 * index, _resonance(frequency)
        f[i, i], f[i, i + 1], f[i + 1, i] = a, b, 1.0
        variance = (1.0 - b) / ((1.0 + b) * ((1.0 - b) ** 2 - a * a))
        q[i, i] = 1.0 / (variance * len(VIBRATION_FREQUENCIES))
    total, power = np.zeros((4, 4)), np.eye(4)
    for _ in range(every):
        total += power @ q @ power.T
        power = f @ power
    return power, total
