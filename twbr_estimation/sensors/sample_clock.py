"""Stamps for samples that a chip took on its own clock and handed over in blocks."""

from __future__ import annotations

SETTLED_READS = 500
"""Reads the estimate remembers: jitter averages out, a warming chip is still followed."""
FIRST_READS = 20
"""Reads the nominal period counts for at the start."""
PERIOD_TOLERANCE = 0.1
"""Largest accepted deviation from the nominal period, as a fraction of it."""
JUMP = 0.1
"""Difference between the clocks that means one of them was set [s]."""


class SampleClock:
    """Relates a chip's sample count to the host's clock with an alpha-beta filter.

    The newest sample in the FIFO is between 0 and 1 sampling periods old when its count
    is read. The filter follows that line: its gains are those of a least-squares fit over
    all reads so far, and stay constant once `SETTLED_READS` are reached.
    """

    def __init__(self, nominal_period: float) -> None:
        """Start with the nominal sampling period [s]."""
        self._nominal = nominal_period * 1e9
        self.restart()
        self.jumps = 0
        """Number of times the clocks were related again because one of them jumped."""

    def restart(self) -> None:
        """Forget the relation between the clocks."""
        self._period = self._nominal
        self._reads = FIRST_READS
        self._newest: int | None = None

    @property
    def period(self) -> float:
        """Estimated sampling period on the host's clock [s]."""
        return self._period * 1e-9

    @property
    def drift(self) -> float:
        """Relative deviation of the chip's sampling period from its nominal value."""
        return self._period / self._nominal - 1.0

    def stamps(self, count: int, now: int, trusted: bool = True) -> list[int]:
        """Return the stamps of the `count` samples taken since the last call, oldest first.

        Args:
            count: Samples new in the FIFO, at least 1.
            now: Host's clock when the count was read [ns].
            trusted: False where `now` is uncertain, as after a slow transfer; the
                stamps then follow from the earlier reads.
        """
        previous = self._newest
        if previous is None:
            self._newest = now - round(0.5 * self._period)
        else:
            self._follow(previous, count, now, trusted)
            if self._newest is None:
                return self.stamps(count, now)
        return self._spread(count, previous)

    def _follow(self, previous: int, count: int, now: int, trusted: bool) -> None:
        # Stamps stay integers: a double holds today's nanoseconds to 256 ns only.
        error = (now - previous) - (count + 0.5) * self._period
        if abs(error) > JUMP * 1e9:
            self.jumps += 1
            self.restart()
            return
        if not trusted:
            self._newest = previous + round(count * self._period)
            return
        n = self._reads
        self._reads = min(n + 1, SETTLED_READS)
        shift = 2.0 * (2 * n + 1) / ((n + 1) * (n + 2)) * error
        self._newest = previous + max(round(count * self._period + shift), count)
        low, high = 1.0 - PERIOD_TOLERANCE, 1.0 + PERIOD_TOLERANCE
        period = self._period + 6.0 / ((n + 1) * (n + 2)) * error / count
        self._period = min(max(period, low * self._nominal), high * self._nominal)

    def _spread(self, count: int, previous: int | None) -> list[int]:
        assert self._newest is not None
        newest, period = self._newest, self._period
        if previous is not None and newest > previous:
            period = (newest - previous) / count
        return [newest - round((count - 1 - index) * period) for index in range(count)]
