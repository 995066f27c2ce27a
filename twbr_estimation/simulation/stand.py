"""The verification stand of Chudzik 2021, section III.B: an IMU on a weighted axis.

A load below the axis makes it a pendulum with a stable zero, a hand moves it, and an encoder
on the axis is the reference. The paper shows its swings and jerks as pictures only: how far
and how often the axis moves is drawn here by seed. The drive's vibration is as strong as the
standard deviation printed with Fig. 7.
"""

from __future__ import annotations

import math

import numpy as np

from ..recording import FloatArray
from .disturbances import STEP, half_sines, stream, vibration
from .planar_sensing import PlanarMotion
from .rig import Ring, ring_acceleration, rung
from .worlds import World

FREQUENCY = 2.0 * math.pi * 0.9
"""Natural frequency of small swings [rad/s]."""
DAMPING = 0.03
"""Share of critical damping of the bearing and the soft wires."""
SWING_SECONDS = (7.0, 12.0)
"""Time from one swing to the next [s]."""
GRIP_SECONDS = 1.5
"""Time in which the hand brings the axis to the angle of release [s]."""
SWING_ANGLES = (math.radians(15.0), math.radians(45.0))
"""Angle at which the hand releases the axis [rad]."""
GRIP_FREQUENCY = 12.0
"""Natural frequency of the hand that holds the axis [rad/s]."""
STOP_ANGLE = math.radians(12.0)
"""Limit of the load's swing in the jerking scene [rad]."""
STOP_RESTITUTION = 0.3
JERK_RATE = 1.2
"""Jerks by the hand [1/s]."""
JERK_SECONDS = (0.05, 0.2)
JERK_ACCELERATION = 40.0
"""Strongest jerk [rad/s^2]."""
LOAD_ARM = 0.1
"""Distance of the load from the axis, whose stops ring the stand [m]."""
DRIVE_VIBRATION = 0.338
"""Vibration by the drive, on each axis [m/s^2]: in world `stand` 1.25 deg of the angle from the
accelerometer."""

_TILT, _RATE = PlanarMotion._fields.index("tilt"), PlanarMotion._fields.index("rate")
_FORWARD, _UP = PlanarMotion._fields.index("shake_forward"), PlanarMotion._fields.index("shake_up")


def static(steps: int) -> FloatArray:
    """Return the motion of a stand at rest, Fig. 6: (steps, 8) fields of `PlanarMotion`."""
    return np.zeros((steps, len(PlanarMotion._fields)))


def vibrating(world: World, steps: int, seed: int) -> FloatArray:
    """Return the motion of a stand at rest with a running drive on the board, Fig. 7."""
    motion = static(steps)
    shaken = world.vibration * DRIVE_VIBRATION * vibration(stream(seed, "vibration"), steps)
    motion[:, _FORWARD : _UP + 1] = shaken
    return motion


def pendulum(steps: int, seed: int) -> FloatArray:
    """Return swings that a hand starts and that die out, Fig. 8."""
    held, angle = _grips(stream(seed, "swings"), steps)
    return _swung(np.zeros(steps), held, angle, math.inf)


def jerking(steps: int, seed: int) -> FloatArray:
    """Return jerks by the hand between two stops, Fig. 9."""
    jerks = half_sines(stream(seed, "jerks"), steps, JERK_RATE, JERK_SECONDS)
    free = np.zeros(steps)
    return _swung(JERK_ACCELERATION * jerks, free, free, STOP_ANGLE)


def _grips(random: np.random.Generator, steps: int) -> tuple[FloatArray, FloatArray]:
    """Return whether the hand holds the axis at each step, and the target angle."""
    held, angle = np.zeros(steps), np.zeros(steps)
    length = int(GRIP_SECONDS / STEP)
    way = 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(length) / (0.7 * length), 1.0))
    begin = int(1.0 / STEP)
    while begin < steps:
        end = min(begin + length, steps)
        target = random.uniform(*SWING_ANGLES) * random.choice([-1.0, 1.0])
        held[begin:end] = 1.0
        angle[begin:end] = target * way[: end - begin]
        begin += int(random.uniform(*SWING_SECONDS) / STEP)
    return held, angle


def _swung(push: FloatArray, held: FloatArray, angle: FloatArray, stop: float) -> FloatArray:
    """Integrate the pendulum.

    Args:
        push: angular acceleration by the hand [rad/s^2], (n,).
        held: 1 where the hand holds the axis, (n,).
        angle: its target angle [rad], (n,).
        stop: largest angle [rad].

    Returns:
        The motion, (n, 8) with the fields of `PlanarMotion`.
    """
    motion = static(push.size)
    tilt, rate, ring = 0.0, 0.0, Ring()
    inputs = zip(push[:-1].tolist(), held[:-1].tolist(), angle[:-1].tolist(), strict=True)
    for row, (pushed, gripped, wanted) in zip(motion[1:], inputs, strict=True):
        turn = pushed - FREQUENCY * (FREQUENCY * math.sin(tilt) + 2.0 * DAMPING * rate)
        turn += gripped * GRIP_FREQUENCY * (GRIP_FREQUENCY * (wanted - tilt) - 2.0 * rate)
        rate += turn * STEP
        tilt += rate * STEP
        shock = 0.0
        if abs(tilt) >= stop and tilt * rate > 0.0:
            shock = -(1.0 + STOP_RESTITUTION) * rate
            rate += shock
        ring = rung(ring, LOAD_ARM * shock)
        row[_TILT], row[_RATE], row[_FORWARD] = tilt, rate, ring_acceleration(ring)
    return motion
