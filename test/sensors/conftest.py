"""A clock that tests turn by hand, for drivers and simulated chips alike."""

from __future__ import annotations

import pytest


class HandClock:
    """Time in nanoseconds that passes only when a test advances it."""

    def __init__(self) -> None:
        self.now = 1_700_000_000_000_000_000

    def __call__(self) -> int:
        return self.now

    def advance(self, seconds: float) -> None:
        self.now += round(seconds * 1e9)


@pytest.fixture
def clock() -> HandClock:
    return HandClock()
