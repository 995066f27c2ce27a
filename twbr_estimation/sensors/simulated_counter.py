"""A simulated encoder counter, with faults on demand."""

from __future__ import annotations

import errno
import math
from collections.abc import Callable

from .encoder import EncoderSettings
from .motion import Angle


class SimulatedCounter:
    """Stands where a counter does: same `read`, `index`, `close`, same `OSError`."""

    def __init__(
        self,
        clock: Callable[[], int],
        angle: Angle,
        settings: EncoderSettings,
        modulus: int = 2**16,
    ) -> None:
        """Start counting.

        Args:
            clock: Time [ns].
            angle: The joint's angle by time [rad]; can be replaced at any time.
            settings: Resolution.
            modulus: Where the count wraps; 0 for never.
        """
        self.angle = angle
        self.modulus = modulus
        self.errors = self.ambiguous = self.behind = 0
        self.remark = ""
        self.zeroed_by_index = False
        self._clock = clock
        self._settings = settings
        self._missing = 0
        self._failures = 0
        self._turn: int | None = None
        self._index: int | None = None

    def fail(self, reads: int) -> None:
        """Let that many reads fail."""
        self._failures = reads

    def lose(self, counts: int) -> None:
        """Miss that many counts, unnoticed."""
        self._missing += counts

    def read(self) -> int:
        """Return the count; the index pulse is at each whole turn of the encoder."""
        if self._failures > 0:
            self._failures -= 1
            raise OSError(errno.EIO, "Input/output error")
        true = math.floor(self.angle(self._clock() * 1e-9) / self._settings.angle_per_count)
        turn = true // self._settings.counts_per_turn
        if self._turn is not None and turn != self._turn:
            at_index = max(turn, self._turn) * self._settings.counts_per_turn
            self._index = self._wrapped(at_index - self._missing)
        self._turn = turn
        return self._wrapped(true - self._missing)

    def _wrapped(self, count: int) -> int:
        return count % self.modulus if self.modulus else count

    def index(self) -> int | None:
        """Return the count at the last index pulse."""
        return self._index

    def close(self) -> None:
        """Release nothing."""
