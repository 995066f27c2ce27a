"""Paths of a hand that holds the robot: from pose to pose, with a sway where asked for."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .engine import Pose

Sway = Callable[[float], Pose]
"""sway(seconds): what is added to a pose."""
SWAY_FREQUENCIES = (0.15, 0.6)
"""[Hz]."""


class Reach(NamedTuple):
    """Amplitude of a sway, rms."""

    along: float = 0.0
    """Horizontally [m]."""
    up: float = 0.0
    """[m]."""
    turn: float = 0.0
    """Of heading [rad]."""
    roll: float = 0.0
    """[rad]."""
    tilt: float = 0.0
    """[rad]."""


def way(begin: Pose, end: Pose, share: float) -> Pose:
    """Return the pose between two, smooth in speed and acceleration; `share` from 0 to 1."""
    u = min(max(share, 0.0), 1.0)
    done = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
    x, y, z, heading, roll, tilt = (b + done * (e - b) for b, e in zip(begin, end, strict=True))
    return x, y, z, heading, roll, tilt


def swaying(reach: Reach, seconds: float, random: np.random.Generator) -> Sway:
    """Return a sway of random waves that begins and ends at rest, after `seconds`."""
    size = (reach.along, reach.along, reach.up, reach.turn, reach.roll, reach.tilt)
    turns = 2.0 * math.pi * random.uniform(*SWAY_FREQUENCIES, (6, 2))
    phases = random.uniform(0.0, 2.0 * math.pi, (6, 2))

    def sway(time: float) -> Pose:
        edge = min(1.0, seconds / 4.0)
        window = _smooth(time / edge) * _smooth((seconds - time) / edge)
        x, y, z, heading, roll, tilt = (
            window * s * (math.sin(t[0] * time + p[0]) + math.sin(t[1] * time + p[1]))
            for s, t, p in zip(size, turns, phases, strict=True)
        )
        return x, y, z, heading, roll, tilt

    return sway


def added(pose: Pose, change: Pose) -> Pose:
    """Return a pose moved by another."""
    x, y, z, heading, roll, tilt = (p + c for p, c in zip(pose, change, strict=True))
    return x, y, z, heading, roll, tilt


def _smooth(u: float) -> float:
    u = min(max(u, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)
