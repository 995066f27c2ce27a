"""The IMU on the moving robot: from motion to readings, one step at a time."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..recording import FloatArray
from ..robot import Calibration, Robot
from ..samples import STANDARD_GRAVITY
from ..sensors.error_model import ImuErrors, Triple, low_passed, resolutions, scale_error
from .disturbances import STEP, stream
from .worlds import World

RESIDUAL_RMS = 1.264
"""rms of the residual's shape at unit amplitude, over +-7 m/s^2 and all phases."""


class PlanarMotion(NamedTuple):
    """Motion of the robot at one instant."""

    velocity: float
    """Axle velocity [m/s]."""
    tilt: float
    rate: float
    lift: float
    """Vertical acceleration of the axle [m/s^2]."""
    shake_forward: float
    """Acceleration of the frame by vibration and ringing, body axes [m/s^2]."""
    shake_left: float
    shake_up: float
    wheel_travel: float
    """Distance the tread has rolled, slip included [m]."""


class Mount(NamedTuple):
    """Position, orientation and bandwidth of the IMU on the body."""

    forward: float
    """Lever arm from the axle [m]."""
    up: float
    rotation: tuple[float, float, float, float, float, float, float, float, float]
    """Sensor to body, row by row."""
    gyro_lag: float
    """Time constant [s]; 0 for none."""
    accel_lag: float


class SensedMotion(NamedTuple):
    """Input of the sensing elements, in sensor axes, and the motion one step ago."""

    rate: Triple
    """Angular rate [rad/s]."""
    force: Triple
    """Specific force [m/s^2]."""
    motion: PlanarMotion


def at_rest(motion: PlanarMotion, mount: Mount) -> SensedMotion:
    """Return the input of a sensor whose robot has been at rest for a long time."""
    force = _to_sensor(_specific_force(motion, motion, mount), mount.rotation)
    return SensedMotion(_to_sensor((0.0, motion.rate, 0.0), mount.rotation), force, motion)


def sense(last: SensedMotion, motion: PlanarMotion, mount: Mount) -> SensedMotion:
    """Return what reaches the sensing elements one `STEP` later."""
    rate = _to_sensor((0.0, motion.rate, 0.0), mount.rotation)
    force = _to_sensor(_specific_force(last.motion, motion, mount), mount.rotation)
    slow, fast = mount.gyro_lag, mount.accel_lag
    return SensedMotion(
        (
            low_passed(last.rate[0], rate[0], STEP, slow),
            low_passed(last.rate[1], rate[1], STEP, slow),
            low_passed(last.rate[2], rate[2], STEP, slow),
        ),
        (
            low_passed(last.force[0], force[0], STEP, fast),
            low_passed(last.force[1], force[1], STEP, fast),
            low_passed(last.force[2], force[2], STEP, fast),
        ),
        motion,
    )


def sense_stretch(sensed: SensedMotion, motion: Any, mount: Mount) -> SensedMotion:
    """Return what reaches the sensing elements after n steps; `motion` as in `rig.stretch`."""
    for i in range(len(motion)):
        row = motion[i]
        now = PlanarMotion(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
        sensed = sense(sensed, now, mount)
    return sensed


def _sensor_velocity(motion: PlanarMotion, mount: Mount) -> tuple[float, float]:
    """Return the horizontal and vertical velocity of the sensor in the world [m/s]."""
    sine, cosine = math.sin(motion.tilt), math.cos(motion.tilt)
    forward = motion.velocity + motion.rate * (mount.up * cosine - mount.forward * sine)
    return forward, -motion.rate * (mount.up * sine + mount.forward * cosine)


def _specific_force(last: PlanarMotion, now: PlanarMotion, mount: Mount) -> Triple:
    """Return the mean specific force over a step, body axes [m/s^2].

    It is a difference of velocities, so that it includes an impulse within the step.
    """
    forward_before, up_before = _sensor_velocity(last, mount)
    forward_now, up_now = _sensor_velocity(now, mount)
    forward = (forward_now - forward_before) / STEP
    up = (up_now - up_before) / STEP + now.lift + STANDARD_GRAVITY
    tilt = 0.5 * (last.tilt + now.tilt)
    sine, cosine = math.sin(tilt), math.cos(tilt)
    return (
        forward * cosine - up * sine + now.shake_forward,
        now.shake_left,
        forward * sine + up * cosine + now.shake_up,
    )


def _to_sensor(
    vector: Triple,
    rotation: tuple[float, float, float, float, float, float, float, float, float],
) -> Triple:
    """Turn a vector from body to sensor axes."""
    x, y, z = vector
    return (
        rotation[0] * x + rotation[3] * y + rotation[6] * z,
        rotation[1] * x + rotation[4] * y + rotation[7] * z,
        rotation[2] * x + rotation[5] * y + rotation[8] * z,
    )


def mount_of(robot: Robot, world: World) -> Mount:
    """Return how the IMU sits on the true robot."""
    rotation = tuple(float(number) for number in robot.rotation().ravel())
    bandwidth = world.accel_bandwidth
    accel_lag = 1.0 / (2.0 * math.pi * bandwidth) if bandwidth > 0.0 else 0.0
    arm = robot.lever_arm
    return Mount(arm[0], arm[2], rotation, world.gyro_lag, accel_lag)  # type: ignore[arg-type]


def imu_errors(
    world: World, calibration: Calibration, seed: int, robot: Robot | None = None
) -> ImuErrors:
    """Return what is wrong with the IMU of a world; the residual's shape varies by seed.

    Args:
        world: its errors.
        calibration: the deterministic ones.
        seed: of the draw.
        robot: gives the ranges; +-250 deg/s and +-2 g where None.
    """
    phases = stream(seed, "residual").uniform(0.0, 2.0 * math.pi, (3, 2)).tolist()
    amplitude = world.calibration_residual / RESIDUAL_RMS
    scales = [
        scale_error(calibration, axis)._replace(residual=amplitude, phases=(pair[0], pair[1]))
        for axis, pair in zip("xyz", phases, strict=True)
    ]
    gain = 1.0 + world.gyro_scale_error
    gyro_count, accel_count = resolutions(robot or Robot())
    return ImuErrors(
        gyro_bias=calibration.gyro_bias,
        gyro_gain=(gain, gain, gain),
        gyro_acceleration=math.radians(world.gyro_acceleration_deg) / STANDARD_GRAVITY,
        gyro_noise=math.radians(world.gyro_noise_deg),
        accel_bias=calibration.accel_bias,
        accel_noise=world.accel_noise,
        scale_x=scales[0],
        scale_y=scales[1],
        scale_z=scales[2],
        digital=world.digital,
        gyro_resolution=gyro_count,
        accel_resolution=accel_count,
    )


def gyro_cross(world: World, seed: int) -> FloatArray:
    """Return the cross-axis sensitivity of the gyro, (3, 3); signs by seed."""
    signs = stream(seed, "gyro cross").choice([-1.0, 1.0], (3, 3))
    return np.asarray(world.gyro_cross_axis * signs * (1.0 - np.eye(3)), dtype=np.float64)


def quantised(angle: FloatArray, counts_per_turn: int, zero: float | FloatArray) -> FloatArray:
    """Return angles [rad] as an encoder counts them from its first reading.

    Args:
        angle: true angles [rad], (n,) or (n, w).
        counts_per_turn: counts of one turn.
        zero: where within a count the encoder starts, 0 to 1; one number or (w,).
    """
    counts = np.floor(angle * (counts_per_turn / (2.0 * math.pi)) + zero)
    return np.asarray(counts * (2.0 * math.pi / counts_per_turn), dtype=np.float64)
