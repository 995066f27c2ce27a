"""The experiments of Laddach 2022 and Chudzik 2021, done again on simulated robots."""

from __future__ import annotations

from .drives import Plan
from .results import DRAWN, PARTS, reproduce

__all__ = ["DRAWN", "PARTS", "Plan", "reproduce"]
