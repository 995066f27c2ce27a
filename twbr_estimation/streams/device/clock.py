"""Stamps from the clock of another device, which was never set and does not run at our rate.

A message arrives some time after it was sent, never before. Arrival minus device time is thus
the offset of the clocks plus a delay, and its lower envelope over time is the offset plus the
shortest delay. The envelope is the line below all points that is closest to them: an edge of
their lower convex hull, the one above the mean of the device times.
"""

from __future__ import annotations

import itertools
from collections import deque

BLOCK = 1.0
"""Device time of which the smallest difference is kept [s]."""
BLOCKS = 60
"""Number kept: a minute, in which a clock's rate hardly changes."""
BLOCKS_FOR_DRIFT = 3
"""Below this many the clocks count as running at the same rate."""
LARGEST_DRIFT = 0.02
"""A ceramic resonator is within 0.5 %, a resistor and capacitor within 2 %."""
RESTART = 1.0
"""Difference from the envelope that means one of the clocks was set or restarted [s]."""
SETTLED = 10
"""Blocks from which on a step of the envelope is spread over time."""
SLEW = 0.005
"""Rate at which stamps follow a changed envelope [s/s]."""


class DeviceClock:
    """Relates device times to our clock, one sample at a time.

    Stamps rise strictly. Where the device restarts, or our clock is set, the relation starts
    afresh and `restarts` counts it.
    """

    def __init__(self, tick: float = 1e-9, ticks_of_wrap: int = 0) -> None:
        """Relate a counter.

        Args:
            tick: Device time of one tick [s].
            ticks_of_wrap: The counter starts again at 0 after this many; 0 where it does not.
        """
        self._tick, self._wrap = tick, ticks_of_wrap
        self.restarts = 0
        self.drift = 0.0
        """Relative slowness of the device's clock against this computer's."""
        self._last_stamp = 0
        self._begin()

    def _begin(self) -> None:
        self._last_ticks: int | None = None
        self._elapsed = 0
        self._first_arrival = 0
        self._blocks: deque[tuple[float, float]] = deque(maxlen=BLOCKS)
        self._block_end = BLOCK
        self._lowest: tuple[float, float] | None = None
        self._line = (0.0, 0.0, 0.0)
        self._residual, self._residual_from = 0.0, 0.0
        self.drift = 0.0

    def stamp(self, ticks: int, arrival: int) -> int:
        """Return the stamp [ns] of a sample taken at `ticks` that arrived at `arrival` [ns]."""
        device = self._device_time(ticks, arrival)
        difference = (arrival - self._first_arrival) * 1e-9 - device
        if self._lowest is None:
            self._lowest, self._line = (device, difference), (device, difference, 0.0)
        elif abs(difference - self._at(device)) > RESTART:
            self.restarts += 1
            self._begin()
            return self.stamp(ticks, arrival)
        self._take(device, difference)
        seconds = device + self._at(device) + self._slewed(device)
        stamp = self._first_arrival + round(seconds * 1e9)
        self._last_stamp = stamp if stamp > self._last_stamp else self._last_stamp + 1
        return self._last_stamp

    def _device_time(self, ticks: int, arrival: int) -> float:
        """Return the device time since the first sample [s]; the counter goes on at its wrap."""
        if self._last_ticks is None:
            self._first_arrival = arrival
        else:
            step = ticks - self._last_ticks
            if step < 0 and self._wrap:
                step %= self._wrap
            self._elapsed += step
        self._last_ticks = ticks
        return self._elapsed * self._tick

    def _at(self, device: float) -> float:
        """Return the envelope at a device time [s]."""
        origin, offset, slope = self._line
        return offset + slope * (device - origin)

    def _take(self, device: float, difference: float) -> None:
        if self._lowest is None or difference < self._lowest[1]:
            self._lowest = (device, difference)
        if device >= self._block_end:
            self._blocks.append(self._lowest)
            self._block_end, self._lowest = device + BLOCK, (device, difference)
            self._refit(device)
        elif difference < self._at(device):  # below the envelope: a shorter delay than any before
            self._move((device, difference, self._line[2]), device)

    def _refit(self, device: float) -> None:
        points = list(self._blocks)
        if len(points) < BLOCKS_FOR_DRIFT:
            best = min(points, key=lambda point: point[1])
            self._move((best[0], best[1], 0.0), device)
            return
        (t0, y0), (t1, y1) = _edge(points)
        slope = (y1 - y0) / (t1 - t0)
        self.drift = slope = max(-LARGEST_DRIFT, min(LARGEST_DRIFT, slope))
        offset = min(y - slope * (t - t0) for t, y in points)
        self._move((t0, offset, slope), device)

    def _move(self, line: tuple[float, float, float], device: float) -> None:
        """Go over to another envelope without a step."""
        before = self._at(device) + self._slewed(device)
        self._line = line
        self._residual, self._residual_from = before - self._at(device), device
        if len(self._blocks) < SETTLED:
            self._residual = 0.0  # offset and drift themselves are still being found

    def _slewed(self, device: float) -> float:
        """Return what is left of the last step of the envelope [s]."""
        gone = SLEW * (device - self._residual_from)
        left = max(abs(self._residual) - gone, 0.0)
        return left if self._residual > 0.0 else -left


def _edge(points: list[tuple[float, float]]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the edge of the lower convex hull below the mean of the times."""
    hull: list[tuple[float, float]] = []
    for point in points:
        while len(hull) > 1 and _turns_down(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    mean = sum(time for time, _ in points) / len(points)
    for left, right in itertools.pairwise(hull):
        if right[0] >= mean:
            return left, right
    return hull[-2], hull[-1]


def _turns_down(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    """Return whether b is on or above the line from a to c."""
    return (b[1] - a[1]) * (c[0] - a[0]) >= (c[1] - a[1]) * (b[0] - a[0])
