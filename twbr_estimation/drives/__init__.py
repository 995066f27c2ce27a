"""A recording that is read, paired and corrected once, and what filters make of it."""

from __future__ import annotations

from .drive import Drive
from .loading import load
from .runs import Runs

__all__ = ["Drive", "Runs", "load"]
