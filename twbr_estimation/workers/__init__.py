"""Workers that do units of work: this process, several of this machine, or a Dask cluster.

What is done is a function of the package and what all units share: `Work`. Which units there are
is decided while they are worked on, so that a million of them take no more memory than ten.
"""

from __future__ import annotations

from .base import Channel, Outcomes, ThisProcess, UnitResult, Work, Workers

__all__ = ["Channel", "Outcomes", "ThisProcess", "UnitResult", "Work", "Workers"]
