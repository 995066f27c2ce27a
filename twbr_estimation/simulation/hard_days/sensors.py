"""Days on which the inertial sensor does not read as the setup says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ...recording import FloatArray, ImuTrack, WheelTrack
from ...robot import Robot
from ..simulate import simulate
from .day import DEGREE, Day, Maker, balancing, clock, ramp, recorded, robot_of
from .prescribed import Motion, Sensor, planar, rolled_angle

DURATION = 60.0


def leans_motionless(seed: int, period: float) -> Day:
    """Leans without a motion for five minutes; the accelerometer is a little off."""
    random = np.random.default_rng([seed, 21])
    robot = robot_of(random)
    step, time = clock(period, 300.0, 5e-3)
    lean = np.full(time.size, random.choice([-1.0, 1.0]) * random.uniform(5.0, 20.0) * DEGREE)
    motion = planar(step, lean, np.zeros_like(time))
    bias = tuple(random.uniform(-0.025, 0.025, 3).tolist())
    gain = tuple(random.uniform(0.995, 1.005, 3).tolist())
    sensor = Sensor(accel_bias=bias, accel_gain=gain)
    wheels = np.zeros((time.size, 2))
    return recorded("leans", motion, wheels, robot, period, seed, sensor, rests=((0.0, 300.0),))


def turned_on_a_shaft(seed: int, period: float) -> Day:
    """Turned slowly through +-90 deg on a shaft, without wheels; scales are a little off."""
    random = np.random.default_rng([seed, 22])
    robot = Robot(lever_arm=(0.0, 0.0, 0.0), gyro_range=500.0 * DEGREE)
    step, time = clock(period, 200.0, 1e-3)
    speed = random.uniform(30.0, 70.0)
    tilt = (
        90.0 * DEGREE * (2.0 / math.pi) * np.arcsin(0.999 * np.sin(math.tau * speed * time / 360.0))
    )
    gain = random.uniform(1.03, 1.04) + random.uniform(-0.005, 0.005, 3)
    sensor = Sensor(gyro_gain=random.uniform(0.985, 0.995), accel_gain=tuple(gain.tolist()))
    motion = planar(step, tilt, np.zeros_like(time))
    return recorded("shaft", motion, None, robot, period, seed, sensor)


def _turning(
    name: str,
    robot: Robot,
    period: float,
    seed: int,
    step: float,
    tilt: FloatArray,
    ahead: FloatArray,
    yaw: FloatArray,
    *,
    encoders: int = 2,
    true_robot: Robot | None = None,
) -> Day:
    """Return the day of a robot that drives `ahead` [m] and turns by `yaw` [rad]."""
    position = np.stack(
        [
            np.cumsum(np.gradient(ahead) * np.cos(yaw)),
            np.cumsum(np.gradient(ahead) * np.sin(yaw)),
            np.zeros_like(ahead),
        ],
        axis=1,
    )
    motion = Motion(step, tilt, np.zeros_like(tilt), yaw, position)
    rolled = rolled_angle(motion, ahead, robot)
    turned = 0.5 * robot.track_width * yaw / robot.wheel_radius
    wheels = rolled if encoders == 1 else np.stack([rolled - turned, rolled + turned], axis=1)
    return recorded(name, motion, wheels, robot, period, seed, true_robot=true_robot)


def _spins(seed: int, period: float, *, aside: float, limit: float, encoders: int = 2) -> Day:
    random = np.random.default_rng([seed, 23])
    robot = robot_of(random, gyro_range=limit * DEGREE)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    speed, lead = random.uniform(8.0, 12.0), random.uniform(1.2, 1.8)
    there = ramp(time, 10.0, 10.0 + lead) - ramp(time, 17.0, 17.0 + lead)
    back = ramp(time, 25.0, 25.0 + lead) - ramp(time, 32.0, 32.0 + lead)
    yaw = np.cumsum(speed * (there - back)) * step
    arm = robot.lever_arm
    true = replace(robot, lever_arm=(arm[0], random.choice([-1.0, 1.0]) * aside, arm[2]))
    return _turning(
        "spins", robot, period, seed, step, tilt, ahead, yaw, encoders=encoders, true_robot=true
    )


def spins_off_the_middle(seed: int, period: float) -> Day:
    """Spins about 10 rad/s; the sensor sits 20 mm to the side, untold."""
    return _spins(seed, period, aside=0.02, limit=1000.0)


def spins_beyond_the_range(seed: int, period: float) -> Day:
    """Spins about 10 rad/s with a gyro of 250 deg/s."""
    return _spins(seed, period, aside=0.0, limit=250.0)


def spins_with_one_encoder(seed: int, period: float) -> Day:
    """The same with one encoder, which does not show the turn that the gyro misses."""
    return _spins(seed, period, aside=0.0, limit=250.0, encoders=1)


def drives_round_corners(seed: int, period: float) -> Day:
    """Drives fast and turns by a right angle every few seconds; nothing is wrong."""
    random = np.random.default_rng([seed, 26])
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    ahead = ahead + random.uniform(0.6, 1.0) * np.cumsum(ramp(time, 3.0, 6.0)) * step
    side = random.choice([-1.0, 1.0])
    yaw = sum(
        side * 0.5 * math.pi * ramp(time, at, at + 1.2)
        for at in np.arange(7.0, DURATION - 2.0, random.uniform(2.5, 5.0))
    )
    return _turning("corners", robot, period, seed, step, tilt, ahead, np.asarray(yaw))


def silent(seed: int, period: float) -> Day:
    """All sensors are silent for 0.4 s every five seconds."""
    made = simulate("W1", period, DURATION, seed)
    truth, wheels, imu = made.recording.truth, made.recording.wheels, made.recording.imu
    assert truth is not None and wheels is not None
    time = (imu.stamps - imu.stamps[0]) * 1e-9
    kept = time % 5.0 < 4.6
    recording = replace(
        made.recording,
        imu=ImuTrack(imu.stamps[kept], imu.gyro[kept], imu.accel[kept]),
        wheels=WheelTrack(wheels.stamps[kept], wheels.angle[kept]),
    )
    ends = tuple(float(end) for end in range(5, 56, 5))
    return Day(recording, made.setup, recovers=ends)


def accelerometer_off(seed: int, period: float) -> Day:
    """The forward accelerometer reads 15 mg wrong when upright."""
    made = simulate("W1", period, DURATION, seed)
    accel = made.recording.imu.accel + np.array([0.147 * (-1.0) ** seed, 0.0, 0.0])
    imu = replace(made.recording.imu, accel=accel)
    return Day(replace(made.recording, imu=imu), made.setup)


def first_sample_zeros(seed: int, period: float) -> Day:
    """The chip's first sample is all zeros; calibration makes them biases."""
    random = np.random.default_rng([seed, 24])
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    sway = random.uniform(2.0, 4.0) * DEGREE * np.sin(math.tau * 0.8 * time) * ramp(time, 2.0, 3.0)
    motion = planar(step, sway, np.zeros_like(time))
    day = recorded(
        "zeros", motion, rolled_angle(motion, 0.0 * time, robot), robot, period, seed,
        rests=((3.0 * period, 2.0),),
    )  # fmt: skip
    imu = day.recording.imu
    accel_bias, gyro_bias = random.uniform(-0.3, 0.3, 3), random.uniform(-0.03, 0.03, 3)
    gyro, accel = imu.gyro + gyro_bias, imu.accel + accel_bias
    gyro[0], accel[0] = 0.0, 0.0
    calibration = replace(
        day.setup.calibration,
        gyro_bias=tuple(gyro_bias.tolist()),
        accel_bias=tuple(accel_bias.tolist()),
    )
    recording = replace(day.recording, imu=ImuTrack(imu.stamps, gyro, accel))
    return replace(day, recording=recording, setup=replace(day.setup, calibration=calibration))


def _balances(name: str, seed: int, period: float, random: np.random.Generator) -> Day:
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    motion = planar(step, tilt, ahead)
    return recorded(name, motion, rolled_angle(motion, ahead, robot), robot, period, seed)


def bias_drifts(seed: int, period: float) -> Day:
    """The gyro's bias moves by 2 deg/s within 20 s."""
    day = _balances("bias", seed, period, np.random.default_rng([seed, 25]))
    imu = day.recording.imu
    moved = 2.0 * DEGREE * ramp((imu.stamps - imu.stamps[0]) * 1e-9, 20.0, 40.0)
    gyro = imu.gyro + moved[:, None] * (0.0, 1.0, 0.0)
    return replace(day, recording=replace(day.recording, imu=replace(imu, gyro=gyro)))


def slow_sensors(seed: int, period: float) -> Day:
    """Gyro and accelerometer read anew every 20 ms and repeat that in between."""
    day = _balances("slow", seed, period, np.random.default_rng([seed, 27]))
    imu, every = day.recording.imu, max(round(0.02 / period), 1)
    latest = np.arange(imu.stamps.size) // every * every
    held = ImuTrack(imu.stamps, imu.gyro[latest], imu.accel[latest])
    return replace(day, recording=replace(day.recording, imu=held))


DAYS: dict[str, Maker] = {
    "leans motionless for 5 min": leans_motionless,
    "turned on a shaft, no wheels": turned_on_a_shaft,
    "spins, sensor 20 mm aside": spins_off_the_middle,
    "spins beyond the gyro's range": spins_beyond_the_range,
    "spins beyond it, one encoder": spins_with_one_encoder,
    "drives round corners": drives_round_corners,
    "silent 0.4 s every 5 s": silent,
    "accelerometer 15 mg off": accelerometer_off,
    "first sample zeros": first_sample_zeros,
    "gyro bias drifts 2 deg/s": bias_drifts,
    "sensors read every 20 ms": slow_sensors,
}
