"""The robot of Sihite 2018, balancing on the spot while it spins.

The loop is the paper's, on the true angles: successive loop closure (33)-(34) and the yaw
controller (35), as in `controllers.slc_sihite2018` without its gains for other robots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..compilation import compiled, source_version
from ..controllers import slc_sihite2018
from ..controllers.base import ControlInput
from ..plants.sihite2018 import (
    EDUMIP,
    Commands,
    SpatialState,
    accelerations,
    advance,
    angular_rate,
    spatial_parameters,
    specific_force,
)
from ..recording import FloatArray, ImuTrack, MotorTrack, Recording, TiltTrack, WheelTrack
from ..robot import Calibration, Robot, Setup
from .disturbances import STEP, stream
from .planar_sensing import quantised

PERIOD = 0.005
"""Of controller and sensors [s]."""
SUPPLY, GEAR = 7.4, 35.57
"""Battery [V] and gear of the eduMIP; with them its motor constants follow from Table II."""
EMF = EDUMIP.torque_damping * SUPPLY / EDUMIP.torque_gain / GEAR
"""Torque and back-EMF constant of a motor, k_2 V / (k_1 k)."""
EDUMIP_ROBOT = Robot(
    wheel_radius=EDUMIP.wheel_radius,
    track_width=EDUMIP.track_width,
    lever_arm=(0.0, 0.0, EDUMIP.body_height),
    gyro_range=math.radians(2000.0),
    body_mass=EDUMIP.body_mass,
    body_height=EDUMIP.body_height,
    body_inertia=EDUMIP.body_inertia,
    body_inertia_roll=EDUMIP.body_inertia_roll,
    body_inertia_yaw=EDUMIP.body_inertia_yaw,
    wheel_mass=EDUMIP.wheel_mass,
    wheel_inertia=EDUMIP.wheel_inertia,
    wheel_inertia_across=EDUMIP.wheel_inertia_across,
    gear_ratio=GEAR,
    winding_resistance=GEAR * EMF * SUPPLY / EDUMIP.torque_gain,
    torque_constant=EMF,
    back_emf_constant=EMF,
    supply_voltage=SUPPLY,
)
"""Table II as a robot; its filters assume the IMU at the centre of mass."""
ENCODER_COUNTS = 2134
"""60 counts a turn of the motor."""
PUSH, PUSH_SECONDS = 0.05, 0.2
"""Standard deviation [N] and correlation time [s] of what keeps the robot from standing still."""
SPIN_UP = 2.0
"""Time to reach the yaw rate [s]."""


@dataclass(frozen=True, slots=True)
class SpinSensor:
    """Properties of the IMU that the filters do not get."""

    offset: float = 0.0157
    """Its distance before the axle's plane [m]."""
    gyro_cross_axis: float = 0.0
    """Modulus of the gyro's cross-axis sensitivity."""
    mounting_error: float = 0.0
    """Modulus of the roll and the pitch of the sensor in the body [rad]."""
    gyro_noise: float = 5e-4
    """Standard deviation of a reading [rad/s]."""
    accel_noise: float = 0.06
    """Standard deviation of a reading [m/s^2]."""


YAW_GAIN, YAW_RATE_GAIN = 1.0, 0.05
"""Of (35), for commands as shares of the supply."""


class Spun(NamedTuple):
    """One simulated spin."""

    recording: Recording
    setup: Setup
    """As the filters get it."""


def spin(
    yaw_rate: float, sensor: SpinSensor, duration: float, seed: int, robot: Robot = EDUMIP_ROBOT
) -> Spun:
    """Let the robot balance while it turns on the spot.

    Args:
        yaw_rate: that it is commanded to [rad/s].
        sensor: the IMU.
        duration: length [s].
        seed: number of the random draw.
        robot: as it is; the IMU's offset comes on top.
    """
    samples = math.floor(duration / PERIOD + 1e-6)
    gains = slc_sihite2018.Parameters(
        inner_gain=1.0,
        outer_gain=1.0,
        damping=0.0,
        yaw_gain=YAW_GAIN * robot.supply_voltage,
        yaw_rate_gain=YAW_RATE_GAIN * robot.supply_voltage,
    )
    controller = slc_sihite2018.derive(gains, robot, PERIOD)
    rows = np.zeros((samples, 11))
    x, y, z = robot.lever_arm
    lever = (x + sensor.offset, y, z)
    every = round(PERIOD / STEP)
    target = yaw_rate * np.clip(np.arange(samples) * PERIOD / SPIN_UP, 0.0, 1.0)
    pushes, parameters = _pushes(samples, seed), spatial_parameters(robot)
    loop = slc_sihite2018.reset(ControlInput(*[0.0] * 9), controller)
    _kernel()(target, pushes, parameters, lever, controller, loop, every, rows)
    assumed = Calibration(gyro_noise=sensor.gyro_noise, accel_noise=sensor.accel_noise)
    return Spun(_recording(rows, sensor, robot, yaw_rate, seed), Setup(robot, assumed))


def _pushes(samples: int, seed: int) -> FloatArray:
    """Return a force that wanders about zero [N], (n,)."""
    from scipy.signal import lfilter

    keep = math.exp(-PERIOD / PUSH_SECONDS)
    white = stream(seed, "pushes").standard_normal(samples)
    force: FloatArray = lfilter([PUSH * math.sqrt(1.0 - keep * keep)], [1.0, -keep], white)
    return force


def _recording(
    rows: FloatArray, sensor: SpinSensor, robot: Robot, yaw_rate: float, seed: int
) -> Recording:
    stamps = (1 + np.arange(rows.shape[0], dtype=np.int64)) * round(PERIOD * 1e9)
    rate, force = _read(rows[:, 3:6], rows[:, 6:9], sensor, seed)
    zeros = stream(seed, "encoders").uniform(0.0, 1.0, 2)
    half = 0.5 * robot.track_width / robot.wheel_radius * rows[:, 2]
    wheels = np.column_stack([rows[:, 1] - half, rows[:, 1] + half])
    return Recording(
        source=f"simulation: spin at {yaw_rate:g} rad/s, seed {seed}",
        imu=ImuTrack(stamps, rate, force),
        wheels=WheelTrack(stamps, quantised(wheels, ENCODER_COUNTS, zeros)),
        reference=TiltTrack(stamps, rows[:, 0].copy()),
        motors=MotorTrack(stamps, rows[:, 9:11].copy()),
    )


def _read(
    rate: FloatArray, force: FloatArray, sensor: SpinSensor, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return the readings of the IMU, from rate and specific force at its place in body axes."""
    signs = stream(seed, "mounting").choice([-1.0, 1.0], 2) * sensor.mounting_error
    turned = Robot(mounting=(float(signs[0]), float(signs[1]), 0.0)).rotation()
    cross = stream(seed, "gyro cross").choice([-1.0, 1.0], (3, 3)) * (1.0 - np.eye(3))
    noise = stream(seed, "noise").standard_normal((rate.shape[0], 6))
    gyro_rate = rate @ turned
    gyro = gyro_rate + gyro_rate @ (sensor.gyro_cross_axis * cross).T
    gyro = gyro + sensor.gyro_noise * noise[:, :3]
    return gyro, force @ turned + sensor.accel_noise * noise[:, 3:]


@lru_cache(maxsize=1)
def _kernel() -> Any:
    control = slc_sihite2018.step

    def run(
        target: Any,
        push: Any,
        p: Any,
        lever: Any,
        controller: Any,
        loop: Any,
        every: int,
        rows: Any,
    ) -> None:
        state, radius = SpatialState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), p.wheel_radius
        forward, turn = 0.0, 0.0
        for i in range(rows.shape[0]):
            turning = accelerations(state, Commands(forward, turn, push[i]), p)
            force = specific_force(state, turning, lever, p)
            rate = angular_rate(state)
            rows[i, 0], rows[i, 1], rows[i, 2] = state.tilt, state.wheel, state.heading
            for axis in range(3):
                rows[i, 3 + axis], rows[i, 6 + axis] = rate[axis], force[axis]
            now = ControlInput(
                PERIOD,
                state.tilt,
                state.tilt_rate,
                radius * (state.wheel + state.tilt),
                radius * (state.wheel_rate + state.tilt_rate),
                state.heading,
                state.yaw_rate,
                0.0,
                target[i],
            )
            loop = control(loop, now, controller)
            rows[i, 9], rows[i, 10] = loop.left, loop.right
            forward, turn = 0.5 * (loop.left + loop.right), 0.5 * (loop.right - loop.left)
            for _ in range(every):
                state = advance(state, Commands(forward, turn, push[i]), p, STEP)

    sources = ("samples.py", "controllers/*.py", "plants/*.py", "simulation/*.py")
    called = (accelerations, specific_force, angular_rate, control, advance)
    return compiled(run, source_version(sources), *called)
