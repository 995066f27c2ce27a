"""Angles of wheels whose speeds are reported, integrated reading by reading."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..samples import RESTART_GAP


class WheelRates:
    """Integrates by the trapezoidal rule; across a gap or a clock set back the wheels stand."""

    def __init__(self) -> None:
        """Start at an angle of 0."""
        self.messages = 0
        """How many were integrated."""
        self._stamp = 0
        self._rates: tuple[float, ...] = ()
        self._angles: list[float] = []

    def add(self, stamp: int, rates: Sequence[float]) -> list[float]:
        """Take velocities [rad/s] at `stamp` [ns]; return the angles [rad], one for each.

        Velocities that are no numbers are left out, and given back as they are.
        """
        self.messages += 1
        rates = tuple(rates)
        if not all(map(math.isfinite, rates)):
            return list(rates)
        if len(rates) != len(self._rates):
            self._angles = [0.0] * len(rates)
        else:
            dt = (stamp - self._stamp) * 1e-9
            if 0.0 < dt <= RESTART_GAP:
                for index, (before, rate) in enumerate(zip(self._rates, rates, strict=True)):
                    self._angles[index] += 0.5 * (before + rate) * dt
        self._stamp, self._rates = stamp, rates
        return list(self._angles)
