"""Velocity commands of browsers: a command lasts only as long as its browser repeats it.

A browser repeats a held key or pad ten times a second. Whatever happens to it, its page or its
network, the robot is stopped `HOLD` after the last command.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

SPEED = 0.2
"""Largest speed that a page may command [m/s]."""
YAW_RATE = 1.5
"""Largest yaw rate that a page may command [rad/s]."""
HOLD = 0.5
"""How long a command lasts that is not repeated [s]."""
STANDING = (0.0, 0.0)


class Handle(Protocol):
    """A call that can be cancelled."""

    def cancel(self) -> None:
        """Do not call."""


class Driver:
    """Passes commands on, and stops the robot when its browser stops, leaves or falls silent."""

    def __init__(
        self,
        drive: Callable[[float, float], None],
        call_later: Callable[[float, Callable[[], None]], Handle],
    ) -> None:
        """Stand still.

        Args:
            drive: Takes a speed [m/s] and a yaw rate [rad/s].
            call_later: Calls a function after a time [s], as `asyncio` loops do.
        """
        self._drive, self._call_later = drive, call_later
        self._who: object = None
        self._limit: Handle | None = None

    @property
    def moving(self) -> bool:
        """Whether the last command is another than to stand still."""
        return self._limit is not None

    def take(self, who: object, shares: object) -> None:
        """Take `[forward, left]` of a browser, shares of the largest; ignore anything else."""
        command = _command(shares)
        if command == STANDING:
            self.stop()
        elif command is not None:
            self._who = who
            if self._limit is not None:
                self._limit.cancel()
            self._limit = self._call_later(HOLD, self.stop)
            self._drive(*command)

    def leave(self, who: object) -> None:
        """Stop where it is this browser that drives."""
        if self._limit is not None and who is self._who:
            self.stop()

    def stop(self) -> None:
        """Stand still."""
        if self._limit is not None:
            self._limit.cancel()
        self._limit = None
        self._drive(*STANDING)


def _command(shares: Any) -> tuple[float, float] | None:
    """Return speed [m/s] and yaw rate [rad/s] within their limits."""
    try:
        forward, left = (float(each) for each in shares)
    except (ValueError, TypeError, OverflowError):
        return None
    if not math.isfinite(forward + left):
        return None
    return SPEED * max(-1.0, min(1.0, forward)), YAW_RATE * max(-1.0, min(1.0, left))
