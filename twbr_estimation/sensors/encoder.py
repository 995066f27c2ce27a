"""Incremental encoders: from a wrapping count to angle and angular velocity."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated, NamedTuple, Protocol

from ..errors import ConfigurationError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..printing.text import counted

INDEX_WIDTH = 4
"""Width of an index pulse [counts]: its edges differ by that between the two directions."""


WIDEST = 2**64
"""Modulus of a counter whose range is unknown; the first wrap shows it."""
WIDTHS = (2**16, 2**24, 2**32, 2**48)
"""Moduli of such counters."""


class Counter(Protocol):
    """Counter of an encoder's edges. Reads that fail raise `OSError`."""

    modulus: int
    """The count runs from 0 to one below this and wraps; 0 where it never wraps."""
    errors: int
    """Edges known to be missed so far."""
    ambiguous: int
    """Edges of the two lines so close that their order, and so the direction, is uncertain."""
    behind: int
    """Reads that left edges for the next one, because too many had come."""
    remark: str
    """Warning about this counter; empty for none."""
    zeroed_by_index: bool
    """True where the device itself sets the count to 0 at the index pulse."""

    def read(self) -> int:
        """Return the count."""

    def index(self) -> int | None:
        """Return the count at the last index pulse; None where none was seen."""

    def close(self) -> None:
        """Release the device."""


@dataclass(frozen=True, slots=True)
class EncoderSettings:
    """Scale of one count, equal for all encoders of a node."""

    counts_per_turn: Annotated[
        int,
        Bounds(1, 10**7, "", "Counts of one turn of the encoder; four for each of its lines "
               "with quadrature x4."),
    ] = 1320  # fmt: skip
    gear_ratio: Annotated[
        float, Bounds(1e-3, 1e4, "", "Turns of the encoder for one turn of the joint.")
    ] = 1.0
    use_index: Annotated[
        bool,
        Meaning("The index pulse sets the zero, and shows how many counts were lost in a turn."),
    ] = False
    velocity_window: Annotated[
        float,
        Bounds(0.0, 1.0, "s", "Time over which counts are averaged for the velocity. Larger is "
               "smoother and later, by half of it."),
    ] = 0.02  # fmt: skip

    def __post_init__(self) -> None:
        require_bounds(self)

    @property
    def angle_per_count(self) -> float:
        """Angle of the joint for one count [rad]."""
        return 2.0 * math.pi / (self.counts_per_turn * self.gear_ratio)


class JointReading(NamedTuple):
    """Angle and angular velocity of a joint."""

    position: float
    """[rad]"""
    velocity: float
    """[rad/s]"""


class Tally(NamedTuple):
    """Errors of an encoder."""

    lost_counts: int = 0
    """Counts found missing or too many at index pulses."""
    missed_edges: int = 0
    """Edges the counter knows that it missed."""
    ambiguous_edges: int = 0
    """Edges whose order, and so the direction, is uncertain."""
    late_reads: int = 0
    """Reads that left edges for the next one, because too many had come."""

    def plus(self, other: Tally) -> Tally:
        """Return the sum."""
        return Tally(*(mine + theirs for mine, theirs in zip(self, other, strict=True)))

    def described(self) -> str:
        """Return the worst of it in words, or nothing."""
        if self.lost_counts or self.missed_edges:
            return "counts were lost"
        if self.ambiguous_edges:
            return f"{self.ambiguous_edges} edges came two in an interrupt: direction uncertain"
        if self.late_reads:
            return f"edges come faster than they are read ({counted(self.late_reads, 'time')})"
        return ""


def unwrapped(change: int, modulus: int) -> int:
    """Return the smallest change that a wrapping counter's change can stand for."""
    if modulus == 0:
        return change
    half = modulus // 2
    return (change + half) % modulus - half


def _width_of_wrap(change: int) -> int:
    """Return the modulus whose wrap this change shows; 0 for none."""
    for width in WIDTHS:
        if abs(abs(change) - width) < width // 16:
            return width
    return 0


class CountVelocity:
    """Velocity from counts: by their number when there are many, by their spacing when few.

    While the joint is still, the last value cannot be refuted at once: the speed is then
    limited to one count in the time since the last one, which decays to zero.
    """

    def __init__(self, window: float) -> None:
        """Average over `window` seconds where counts come faster than that."""
        self._window = round(window * 1e9)
        self._changes: deque[tuple[int, int]] = deque()
        self._velocity = 0.0

    def restart(self) -> None:
        """Forget everything, as after a change of the zero."""
        self._changes.clear()
        self._velocity = 0.0

    def update(self, stamp: int, count: int) -> float:
        """Return the velocity in counts per second at `stamp` [ns]."""
        changes = self._changes
        if not changes or stamp < changes[-1][0]:
            self.restart()
            changes.append((stamp, count))
            return 0.0
        since = stamp - changes[-1][0]
        if since == 0:
            return self._velocity
        if count == changes[-1][1]:
            limit = 1e9 / since
            return max(-limit, min(limit, self._velocity))
        if since > self._window:  # a lone count: its spacing is all there is
            self._velocity = (count - changes[-1][1]) * 1e9 / since
            changes.clear()
            changes.append((stamp, count))
            return self._velocity
        changes.append((stamp, count))
        while len(changes) > 2 and stamp - changes[1][0] >= self._window:
            changes.popleft()
        self._velocity = (count - changes[0][1]) * 1e9 / (stamp - changes[0][0])
        return self._velocity


class Encoder:
    """One encoder: unwraps, scales, keeps the zero, and watches the index."""

    def __init__(
        self, counter: Counter, settings: EncoderSettings, sign: int = 1, start: float = 0.0
    ) -> None:
        """Take the present position for `start`.

        Args:
            counter: What counts.
            settings: What a count means.
            sign: 1, or -1 where the count falls when the joint turns positively.
            start: Angle of the joint now [rad]; the index overrules it.

        Raises:
            ConfigurationError: a sign that is neither.
            OSError: the counter cannot be read.
        """
        if sign not in (1, -1):
            raise ConfigurationError(f"sign: {sign} is neither 1 nor -1")
        self._counter = counter
        self._settings = settings
        self._scale = sign * settings.angle_per_count
        self._velocity = CountVelocity(settings.velocity_window)
        self._last = counter.read()
        self._total = self._last
        self._index: int | None = None
        self._zero = 0
        self.lost_counts = 0
        """Counts found missing or too many at index pulses."""
        self.set_angle(start)

    @property
    def indexed(self) -> bool:
        """Whether the zero comes from an index pulse."""
        return self._index is not None

    def tally(self) -> Tally:
        """Return what went wrong since the counter was opened."""
        counter = self._counter
        return Tally(self.lost_counts, counter.errors, counter.ambiguous, counter.behind)

    @property
    def missed_edges(self) -> int:
        """Edges the counter knows that it missed."""
        return self._counter.errors

    @property
    def remark(self) -> str:
        """Warning about the counter; empty for none."""
        return self._counter.remark

    def set_angle(self, angle: float = 0.0) -> None:
        """Call the present position `angle` [rad]."""
        self._offset = angle - self._total * self._scale

    def read(self, stamp: int) -> JointReading:
        """Return angle and velocity now; `stamp` [ns] is the time of now."""
        self._follow(self._counter.read())
        if self._settings.use_index:
            self._watch_index()
        velocity = self._velocity.update(stamp, self._total)
        return JointReading(self._total * self._scale + self._offset, velocity * self._scale)

    def _follow(self, count: int) -> None:
        modulus = self._counter.modulus
        change = unwrapped(count - self._last, modulus)
        if modulus == WIDEST and (width := _width_of_wrap(change)):
            modulus = self._counter.modulus = width
            change = unwrapped(change, width)
        self._last = count
        if not self._counter.zeroed_by_index:
            self._total += change
            return
        self._total = unwrapped(count, modulus)
        self._offset = 0.0
        if abs(change) > self._settings.counts_per_turn // 4:  # that was the index
            self._velocity.restart()

    def _watch_index(self) -> None:
        mark = self._counter.index()
        if mark is None:
            return
        at_index = self._total + unwrapped(mark - self._last, self._counter.modulus)
        if self._index is None:
            self._zero = at_index
        elif at_index != self._index:
            turn = self._settings.counts_per_turn
            missing = unwrapped(at_index - self._zero, turn)
            if abs(missing) > INDEX_WIDTH:
                self.lost_counts += abs(missing)
                self._zero += missing
        self._index = at_index
        self._offset = -self._zero * self._scale

    def close(self) -> None:
        """Release the counter."""
        self._counter.close()
