"""The simulated rig: robot, ground, disturbances and sensors of Laddach 2022."""

from __future__ import annotations

from .scenes import SCENES
from .simulate import Simulated, simulate
from .worlds import WORLDS, World, world_named

__all__ = ["SCENES", "WORLDS", "Simulated", "World", "simulate", "world_named"]
