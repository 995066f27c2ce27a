"""The user's robot in MuJoCo: a physics that shares no equation with the filters."""

from __future__ import annotations

from .scenes import SCENES
from .simulate import simulate

__all__ = ["SCENES", "simulate"]
