"""Scenes of a simulation: motion of the robot, or of the stand of Chudzik 2021."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..plants.laddach2022 import PlantParameters
from ..recording import FloatArray
from . import stand
from .disturbances import STEP, disturb
from .kernels import drive
from .planar_sensing import PlanarMotion
from .rig_controller import balance_gains
from .turning import Turning, turning
from .worlds import World

POSE_LIMIT = math.radians(80.0)
"""Largest angle of the poses [rad]."""
POSE_SECONDS, MOVE_SECONDS = 3.0, 1.0
"""Time for which a pose is held, and time to reach it [s]."""


class Performed(NamedTuple):
    """The motion of a scene, one row a step."""

    motion: FloatArray
    """(n, 8) with the fields of `PlanarMotion`."""
    falls: int
    turning: Turning | None = None
    """Addition to the planar motion, in a world with turns."""
    wheels: bool = True
    """Whether there are wheels to be counted."""


def _drive(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    period = world.control_period
    gains = balance_gains(plant, period)
    disturbances = disturb(world, steps, seed)
    if world.track_width == 0.0:
        return Performed(*drive(disturbances, plant, gains, period))
    disturbances = replace(disturbances, slip=np.zeros(steps))  # each wheel slips independently
    return Performed(*drive(disturbances, plant, gains, period), turning(world, steps, seed))


def _still(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    del world, plant, seed
    return Performed(np.zeros((steps, len(PlanarMotion._fields))), 0)


def _poses(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    """Hold angles from one side to the other, after an upright start; the wheels stay."""
    del world, plant, seed
    stage = POSE_SECONDS + MOVE_SECONDS
    count = max(int(steps * STEP / stage) - 1, 1)
    angles = np.concatenate([[0.0], np.linspace(-POSE_LIMIT, POSE_LIMIT, count)])
    time = np.arange(steps) * STEP
    stages = np.minimum((time / stage).astype(np.int64), count)
    share = np.clip((time - stages * stage) / MOVE_SECONDS, 0.0, 1.0)
    before, after = angles[np.maximum(stages - 1, 0)], angles[stages]
    motion = np.zeros((steps, len(PlanarMotion._fields)))
    turn = 2.0 * math.pi * share
    motion[:, 1] = before + (after - before) * (share - np.sin(turn) / (2.0 * math.pi))
    motion[:, 2] = (after - before) * (1.0 - np.cos(turn)) / MOVE_SECONDS
    return Performed(motion, 0)


def _static(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    del world, plant, seed
    return Performed(stand.static(steps), 0, wheels=False)


def _vibrating(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    del plant
    return Performed(stand.vibrating(world, steps, seed), 0, wheels=False)


def _pendulum(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    del world, plant
    return Performed(stand.pendulum(steps, seed), 0, wheels=False)


def _jerking(world: World, plant: PlantParameters, steps: int, seed: int) -> Performed:
    del world, plant
    return Performed(stand.jerking(steps, seed), 0, wheels=False)


SCENES: Mapping[str, Callable[[World, PlantParameters, int, int], Performed]] = MappingProxyType(
    {
        "drive": _drive,
        "still": _still,
        "poses": _poses,
        "static": _static,
        "vibrating": _vibrating,
        "pendulum": _pendulum,
        "jerking": _jerking,
    }
)
"""Scenes by name; each takes world, plant, number of steps and seed."""
