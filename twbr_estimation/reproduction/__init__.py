"""The experiments of Laddach 2022, done again on the simulated rig."""

from __future__ import annotations

from .drives import Plan
from .results import PARTS, reproduce

__all__ = ["PARTS", "Plan", "reproduce"]
