"""Days with falls faster than the gyro's range."""

from __future__ import annotations

import math

import numpy as np

from ...robot import EncoderPlacement
from .day import DEGREE, Day, Maker, balancing, between, clock, ramp, recorded, robot_of
from .prescribed import Sensor, planar, rolled_angle

NARROW = {"gyro_range": 250.0 * DEGREE, "accel_range": 2.0 * 9.80665}


def _thrown(
    seed: int,
    period: float,
    *,
    seconds: tuple[float, float],
    degrees: tuple[float, float],
    ground: bool = False,
    sensor: Sensor | None = None,
) -> Day:
    random = np.random.default_rng([seed, 31])
    placement = EncoderPlacement.GROUND if ground else EncoderPlacement.BODY
    robot = robot_of(random, encoder_placement=placement, **NARROW)
    step, time = clock(period, 20.0, 2.5e-4)
    begin, length = random.uniform(6.0, 9.0), random.uniform(*seconds)
    to = random.choice([-1.0, 1.0]) * random.uniform(*degrees) * DEGREE
    tilt = to * np.clip((time - begin) / length, 0.0, 1.0) ** 2
    motion = planar(step, tilt, np.zeros_like(time))
    wheels = np.zeros_like(time) if ground else -tilt
    wheels = np.stack([wheels, wheels], axis=1)
    rest = (begin + length, 20.0)
    return recorded(
        "thrown",
        motion,
        wheels,
        robot,
        period,
        seed,
        sensor or Sensor(averaged=0.5 * period),
        rests=(rest,),
    )


def thrown_on_a_pivot(seed: int, period: float) -> Day:
    """Falls within 50 ms on a stop; the encoder counts against the ground and stands."""
    return _thrown(seed, period, seconds=(0.04, 0.07), degrees=(35.0, 60.0), ground=True)


def thrown_on_wheels(seed: int, period: float) -> Day:
    """The same with encoders on the body."""
    return _thrown(seed, period, seconds=(0.04, 0.07), degrees=(35.0, 60.0))


def clipped_before_low_pass(seed: int, period: float) -> Day:
    """A chip clips before its low-pass, so that hardly a reading stands at the limit."""
    sensor = Sensor(averaged=0.012, clips_first=True)
    return _thrown(seed, period, seconds=(0.06, 0.12), degrees=(70.0, 100.0), sensor=sensor)


def falls_and_stands_up(seed: int, period: float) -> Day:
    """Balances, falls at 400 to 700 deg/s, lies, is put up again, three times."""
    return _falls(seed, period)


def falls_with_motors_on(seed: int, period: float) -> Day:
    """The same, and the wheels race until a second after each fall."""
    return _falls(seed, period, racing=30.0)


def _falls(seed: int, period: float, racing: float = 0.0) -> Day:
    """Return the day of three falls, in which the wheels race at so many [rad/s]."""
    random = np.random.default_rng([seed, 32])
    robot = robot_of(random, **NARROW)
    step, time = clock(period, 60.0, 2.5e-4)
    tilt, ahead = balancing(time, random)
    rests, recovers, free = [], [], np.zeros_like(time)
    for begin in (10.0, 28.0, 46.0):
        at = begin + random.uniform(0.0, 4.0)
        to = random.choice([-1.0, 1.0]) * random.uniform(70.0, 95.0) * DEGREE
        fastest = random.uniform(400.0, 700.0) * DEGREE
        length = 2.0 * abs(to) / fastest
        fallen = np.clip((time - at) / length, 0.0, 1.0) ** 2
        lies = at + length
        up = ramp(time, lies + 3.0, lies + 4.0)
        away = fallen * (1.0 - up)
        tilt = tilt * (1.0 - fallen + fallen * up) + to * away
        ahead = np.cumsum(np.gradient(ahead) * (1.0 - away))
        free += racing * between(time, at + 0.5 * length, lies + 1.0, 0.1)
        rests.append((lies, lies + 3.0))
        recovers.append(lies + 4.0)
    motion = planar(step, tilt, ahead)
    wheels = rolled_angle(motion, ahead, robot) + np.cumsum(free) * step
    wheels = np.stack([wheels, wheels], axis=1)
    return recorded(
        "falls",
        motion,
        wheels,
        robot,
        period,
        seed,
        Sensor(averaged=0.5 * period),
        rests=tuple(rests),
        recovers=tuple(recovers),
    )


def into_a_wall(seed: int, period: float) -> Day:
    """Drives into a wall, stopped in 20 ms; the accelerometer clips."""
    random = np.random.default_rng([seed, 33])
    robot = robot_of(random, **NARROW)
    step, time = clock(period, 20.0, 2.5e-4)
    speed = random.uniform(1.0, 2.0) * (
        ramp(time, 6.0, 7.5) - np.clip((time - 10.0) / 0.02, 0.0, 1.0)
    )
    ahead = np.cumsum(speed) * step
    lean = 2.0 * DEGREE * np.sin(math.tau * 0.8 * time) * ramp(time, 2.0, 3.0)
    motion = planar(step, lean, ahead)
    wheels = rolled_angle(motion, ahead, robot)
    return recorded(
        "into a wall",
        motion,
        np.stack([wheels, wheels], axis=1),
        robot,
        period,
        seed,
        Sensor(averaged=0.5 * period),
        recovers=(10.02,),
    )


DAYS: dict[str, Maker] = {
    "thrown on a pivot": thrown_on_a_pivot,
    "thrown on its wheels": thrown_on_wheels,
    "clipped before the low-pass": clipped_before_low_pass,
    "falls and is put up": falls_and_stands_up,
    "falls, its motors stay on": falls_with_motors_on,
    "into a wall": into_a_wall,
}
