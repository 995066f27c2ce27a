"""Recordings of a robot's hard days, made without the equations of the filters."""

from __future__ import annotations

from collections.abc import Mapping

from . import encoders, falls, handled, sensors
from .day import Day as Day
from .day import Maker as Maker

DAYS: Mapping[str, Maker] = {**handled.DAYS, **encoders.DAYS, **sensors.DAYS, **falls.DAYS}
"""What makes each day, by name."""
