"""A recording that is read, paired and corrected once, and the results of filters on it."""

from __future__ import annotations

from .drive import Drive
from .loading import load
from .runs import Runs

__all__ = ["Drive", "Runs", "load"]
