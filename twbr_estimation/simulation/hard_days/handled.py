"""Days on which a hand, a wall or the floor holds the robot."""

from __future__ import annotations

import math

import numpy as np

from ...recording import FloatArray
from .day import DEGREE, Day, Maker, balancing, between, clock, ramp, recorded, robot_of
from .prescribed import Motion, planar, rolled_angle

DURATION = 60.0


def _both(angle: FloatArray) -> FloatArray:
    return np.stack([angle, angle], axis=1)


def _turns(step: float, rate: FloatArray) -> FloatArray:
    return np.asarray(np.cumsum(rate) * step)


def _carried(
    seed: int,
    period: float,
    *,
    free: bool,
    one: bool = False,
    turning: bool = False,
    walked: float = 0.0,
) -> Day:
    random = np.random.default_rng([seed, 1])
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    begin = random.uniform(14.0, 22.0)
    end = begin + random.uniform(15.0, 22.0)
    held = between(time, begin, end, 1.0)
    sway = [
        random.uniform(0.15, 0.3) * np.sin(math.tau * random.uniform(0.2, 0.5) * time + k)
        for k in range(2)
    ]
    carried_tilt = random.uniform(10.0, 18.0) * np.sin(math.tau * random.uniform(0.2, 0.4) * time)
    roll = held * random.uniform(6.0, 14.0) * DEGREE * np.sin(math.tau * 0.23 * time + 1.0)
    yaw = held * np.sin(math.tau * 0.15 * time) if turning else np.zeros_like(time)
    rolling = np.cumsum(np.gradient(ahead) * (1.0 - held))
    position = np.stack(
        [
            rolling + held * sway[0] + walked * ramp(time, begin + 2.0, end - 2.0),
            held * sway[1],
            0.5 * held,
        ],
        axis=1,
    )
    motion = Motion(step, (1.0 - held) * tilt + held * carried_tilt * DEGREE, roll, yaw, position)
    wheel = np.cumsum(np.gradient(ahead / robot.wheel_radius - tilt) * (1.0 - held))
    if free:
        speed = random.uniform(10.0, 25.0) * np.sin(math.tau * random.uniform(0.1, 0.3) * time)
        wheel = wheel + _turns(step, held * speed)
    wheels = wheel if one else _both(wheel)
    return recorded("carried", motion, wheels, robot, period, seed, recovers=(end,))


def carried_wheels_stand(seed: int, period: float) -> Day:
    """Picked up and carried for about 20 s; the motors hold the wheels."""
    return _carried(seed, period, free=False)


def carried_one_encoder(seed: int, period: float) -> Day:
    """The same with one encoder, carried round corners over some metres."""
    return _carried(seed, period, free=False, one=True, turning=True, walked=2.0)


def carried_straight(seed: int, period: float) -> Day:
    """The same with two encoders, carried straight ahead: at first the walk looks like a lean."""
    return _carried(seed, period, free=False, walked=3.0)


def carried_wheels_run(seed: int, period: float) -> Day:
    """The same with wheels that run freely."""
    return _carried(seed, period, free=True)


def lifted(seed: int, period: float) -> Day:
    """Lifted for two seconds; the wheels race."""
    random = np.random.default_rng([seed, 2])
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    begin = random.uniform(15.0, 30.0)
    held = between(time, begin, begin + random.uniform(2.0, 3.0), 0.4)
    gone = 0.4 * ramp(time, begin + 0.3, begin + 2.0)
    lean = random.uniform(3.0, 8.0) * DEGREE * np.sin(math.tau * 0.6 * time)
    position = np.stack(
        [np.cumsum(np.gradient(ahead) * (1.0 - held)) + gone, gone, 0.15 * held], axis=1
    )
    zero = np.zeros_like(time)
    motion = Motion(step, (1.0 - held) * tilt + held * lean, zero, zero, position)
    wheel = np.cumsum(np.gradient(ahead / robot.wheel_radius - tilt) * (1.0 - held))
    wheel += _turns(step, held * random.uniform(15.0, 30.0) * np.sign(np.sin(2.0 * time)))
    return recorded("lifted", motion, _both(wheel), robot, period, seed, recovers=(begin + 3.0,))


def against_a_wall(seed: int, period: float) -> Day:
    """Held against a wall for some seconds while the wheels turn on the spot."""
    random = np.random.default_rng([seed, 3])
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    begin = random.uniform(15.0, 25.0)
    end = begin + random.uniform(6.0, 12.0)
    held = between(time, begin, end, 0.3)
    lean = (random.uniform(-12.0, 12.0) + 1.5 * np.sin(math.tau * 1.3 * time)) * DEGREE
    motion = planar(
        step,
        (1.0 - held) * tilt + held * lean,
        np.cumsum(np.gradient(ahead) * (1.0 - held)),
    )
    wheel = np.cumsum(np.gradient(ahead / robot.wheel_radius - tilt) * (1.0 - held))
    wheel -= np.cumsum(np.gradient(lean) * held)
    speed = random.uniform(4.0, 12.0) * np.sin(
        math.tau * random.uniform(0.15, 0.4) * (time - begin)
    )
    wheel += _turns(step, held * speed)
    return recorded("wall", motion, _both(wheel), robot, period, seed, recovers=(end,))


def starts_lying(seed: int, period: float) -> Day:
    """Lies on its back or face at the start, is lifted upright by hand, then balances."""
    random = np.random.default_rng([seed, 4])
    robot = robot_of(random)
    step, time = clock(period, DURATION)
    tilt, ahead = balancing(time, random)
    lying = random.choice([-1.0, 1.0]) * random.uniform(75.0, 110.0) * DEGREE
    up = ramp(time, 3.0, 4.5)
    rolling = np.cumsum(np.gradient(ahead) * ramp(time, 4.2, 4.7))
    motion = planar(step, (1.0 - up) * lying + up * tilt, rolling)
    wheels = _both(rolled_angle(motion, rolling, robot))
    return recorded("lying", motion, wheels, robot, period, seed, rests=((0.0, 3.0),))


def spun_in_hand(seed: int, period: float) -> Day:
    """Held in the hand while the wheels race for some seconds; later a fall."""
    random = np.random.default_rng([seed, 5])
    robot = robot_of(random, gyro_range=250.0 * DEGREE)
    step, time = clock(period, 90.0)
    begin = random.uniform(5.0, 8.0)
    held = between(time, begin, begin + 6.0, 0.5)
    free = 1.0 - between(time, begin - 1.0, begin + 8.0, 1.0)
    fall_at, fast = random.uniform(60.0, 80.0), random.uniform(0.35, 0.6)
    fallen = ramp(time, fall_at, fall_at + fast)
    tilt = held * 10.0 * np.sin(math.tau * 0.7 * (time - begin)) + free * 5.0 * np.sin(
        math.pi * time
    )
    tilt = DEGREE * (tilt * (1.0 - fallen) + random.choice([-80.0, 80.0]) * fallen)
    motion = planar(step, tilt, np.zeros_like(time))
    wheel = _turns(step, random.uniform(20.0, 45.0) * held) - tilt
    rest = (fall_at + fast, 90.0)
    return recorded("spun", motion, _both(wheel), robot, period, seed, rests=(rest,))


DAYS: dict[str, Maker] = {
    "carried, wheels stand": carried_wheels_stand,
    "carried, one encoder": carried_one_encoder,
    "carried straight ahead": carried_straight,
    "carried, wheels run": carried_wheels_run,
    "lifted 2 s, wheels run": lifted,
    "held against a wall": against_a_wall,
    "starts lying": starts_lying,
    "wheels spun in the hand": spun_in_hand,
}
