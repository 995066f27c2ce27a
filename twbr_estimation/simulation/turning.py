"""Turns about the vertical, roll over uneven ground, and slip of each wheel.

Yaw rate and roll are prescribed: they are added to the planar drive and do not influence its
tilt and speed. Each kind has a separate random stream, as in `disturbances`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..recording import FloatArray
from .disturbances import SLIP_SECONDS, SLIP_SPEED, STEP, WEAKEST, half_sines, smoothed, stream
from .worlds import World

TURN_SECONDS = (1.0, 3.0)
"""Time for which the robot keeps a yaw rate [s]."""
STRAIGHT_SHARE = 0.25
"""Share of the time it drives straight ahead."""
SIDE_SLOPE_SECONDS = (2.0, 4.0)
"""Time on a side slope [s]."""
SMOOTHING = 0.25
"""Time over which yaw rate and side slope are averaged twice [s]."""
CURB_RATE = 0.4
"""Bumps met by one wheel alone [1/s]."""
CURB_SECONDS = (0.25, 0.6)


@dataclass(frozen=True, slots=True)
class Turning:
    """Addition to the planar drive, one row a step of `STEP`; n steps."""

    yaw_rate: FloatArray
    """Rate of the heading about the world's vertical [rad/s], (n,)."""
    roll: FloatArray
    """Roll of the axle about the heading, positive with the left wheel up [rad], (n,)."""
    roll_rate: FloatArray
    """Its rate [rad/s], (n,)."""
    lift_speed: FloatArray
    """Vertical speed of the axle's middle over one-wheel bumps [m/s], (n,)."""
    slip: FloatArray
    """Speed of the left and the right tread over the ground [m/s], (n, 2)."""


def turning(world: World, steps: int, seed: int) -> Turning:
    """Draw the turning of a drive of `steps` steps."""
    largest = math.radians(world.roll_deg)
    levels = _levels(stream(seed, "yaw"), steps, TURN_SECONDS, STRAIGHT_SHARE)
    # One step more than asked for, so that the last rate is a central difference, too.
    slope = _levels(stream(seed, "side slope"), steps + 1, SIDE_SLOPE_SECONDS, 0.0)
    curb = largest * _curbs(stream(seed, "curb"), steps + 1)
    roll = largest * smoothed(slope, SMOOTHING) + curb
    lift = 0.5 * world.track_width * np.sin(np.abs(curb))
    slip = [
        half_sines(stream(seed, f"slip {side}"), steps, world.slips_per_second, SLIP_SECONDS)
        for side in ("left", "right")
    ]
    return Turning(
        yaw_rate=world.yaw_rate * smoothed(levels, SMOOTHING),
        roll=roll[:-1],
        roll_rate=np.gradient(roll, STEP)[:-1],
        lift_speed=np.gradient(lift, STEP)[:-1],
        slip=SLIP_SPEED * np.column_stack(slip),
    )


def straight(steps: int) -> Turning:
    """Return the turning of a robot that does not turn."""
    zero = np.zeros(steps)
    return Turning(zero, zero, zero, zero, np.zeros((steps, 2)))


def _levels(
    random: np.random.Generator, steps: int, seconds: tuple[float, float], zero_share: float
) -> FloatArray:
    """Return constant levels between -1 and 1, a share of them 0, after a quiet first second."""
    levels = np.zeros(steps)
    begin = int(1.0 / STEP)
    while begin < steps:
        end = begin + int(random.uniform(*seconds) / STEP)
        level, is_zero = random.uniform(-1.0, 1.0), random.random() < zero_share
        levels[begin:end] = 0.0 if is_zero else level
        begin = end
    return levels


def _curbs(random: np.random.Generator, steps: int) -> FloatArray:
    """Return smooth bumps under one wheel, up to +-1, one after the other."""
    curbs = np.zeros(steps)
    begin = int(1.0 / STEP)
    while True:
        begin += int(random.exponential(1.0 / CURB_RATE) / STEP)
        length = int(random.uniform(*CURB_SECONDS) / STEP)
        height = random.uniform(WEAKEST, 1.0) * random.choice([-1.0, 1.0])
        if begin >= steps:
            return curbs
        end = min(begin + length, steps)
        curbs[begin:end] = height * np.sin(np.pi * np.arange(end - begin) / length) ** 4
        begin += length
