"""What correction and filters need of a compiled step; `live_code` provides such steps."""

from __future__ import annotations

from typing import Any, Protocol


class StepCode(Protocol):
    """A step function as machine code, which keeps the state until it is asked for."""

    def begin(self, coefficients: Any, state: Any) -> bool:
        """Go on from a state, with these coefficients; False where they do not fit the code."""

    def change(self, coefficients: Any) -> bool:
        """Go on with other coefficients; False, and nothing changed, where they do not fit."""

    def step(self, sample: tuple[float, ...]) -> tuple[float, ...]:
        """Take a sample; return the results."""

    def state(self) -> Any:
        """Return the state as it is now."""
