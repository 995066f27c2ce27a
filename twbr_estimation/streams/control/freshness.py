"""Freshness of an arriving tilt: its stamp against the clock, its value against the last.

| what arrives | outcome |
|---|---|
| a clock that has not begun (`use_sim_time` without `/clock`) | `NO_CLOCK` |
| a stamp older than `tilt_timeout` | `TILT_STALE` |
| a stamp ahead of the clock, or more than `CLOCK_GAP` behind it | `OTHER_CLOCK` |
| the same tilt and rate, to the last digit, for `tilt_timeout` while the motors are driven | `FROZEN` |
"""  # noqa: E501

from __future__ import annotations

from ...samples import SECONDS_PER_NANOSECOND
from .balance import Standing

CLOCK_GAP = 5.0
"""A stamp further behind the clock [s] is one of another clock, not a late one."""
FEWEST_REPEATS = 5
"""Equal tilts in a row before they count as frozen, for slow estimators."""


def judged_by_stamp(stamp: int, now: int, timeout: float) -> Standing | None:
    """Return what is wrong with a stamp; None where nothing is.

    Args:
        stamp: Of the tilt [ns].
        now: Time of the clock [ns]; 0 where a simulated clock has not begun.
        timeout: Age from which on a tilt is stale, and how far it may be ahead [s].
    """
    if now <= 0:
        return Standing.NO_CLOCK
    age = (now - stamp) * SECONDS_PER_NANOSECOND
    if not -timeout <= age <= CLOCK_GAP:
        return Standing.OTHER_CLOCK
    return Standing.TILT_STALE if age > timeout else None


class FrozenTilt:
    """Notices a tilt that stays the same while the motors move the robot."""

    def __init__(self) -> None:
        """Start without a tilt."""
        self._value: tuple[float, float | None] | None = None
        self._since = 0
        self._repeats = 0
        self._frozen = False

    def add(
        self, stamp: int, value: tuple[float, float | None], driven: bool, limit: float
    ) -> bool:
        """Take a tilt; return whether it has been the same for too long.

        Args:
            stamp: Of the tilt [ns].
            value: Tilt [rad] and rate [rad/s], or None where there is no rate.
            driven: Whether the motors run.
            limit: How long it may stay the same while they do [s].
        """
        if value != self._value:
            self._value, self._frozen, self._repeats = value, False, 0
        elif not self._frozen:
            self._repeats = self._repeats + 1 if driven else 0
            if self._repeats <= 1:
                self._since = stamp
            long = (stamp - self._since) * SECONDS_PER_NANOSECOND >= limit
            self._frozen = long and self._repeats >= FEWEST_REPEATS
        return self._frozen
