"""What a test of the campaign promises and what was seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Row(NamedTuple):
    """One line of the table."""

    test: str
    tries: int
    promised: str
    seen: str
    held: bool


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is tried."""

    scale: float = 1.0
    """Share of the full number of tries; at least one is made."""
    seed: int = 1
    """Of all random draws."""
    hours: float = 1.0
    """Length of the long run."""

    def tries(self, full: int) -> int:
        """Return how many of `full` tries to make."""
        return max(1, round(self.scale * full))


class Skipped(Exception):  # noqa: N818 - no error
    """A part that cannot run here; its text says what it needs."""
