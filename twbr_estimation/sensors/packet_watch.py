"""Separate samples from what a broken chip or a disturbed bus gives in their place."""

from __future__ import annotations

from .mpu6050 import Words
from .mpu6050_counters import Counters
from .mpu6050_settings import Mpu6050Settings
from .stuck_words import StuckWords

REPEATS_PASSED = 3
"""Equal packets in a row that pass; two ticks may read the same sample."""
JUMP = 4096
"""Change from packet to packet that is worth a second look, an eighth of full scale [counts]."""
_IDLE = {0: "zeros", -1: "ones"}


class PacketWatch:
    """Looks at each packet once, in order."""

    def __init__(self, settings: Mpu6050Settings, counters: Counters) -> None:
        self._counters = counters
        self._limit = settings.frozen_samples
        self._passed = min(REPEATS_PASSED, self._limit)
        self._last: Words | None = None
        self._equal = self._invalid_in_a_row = 0
        self.stuck = StuckWords(settings)
        """Axes that do not move."""
        self.invalid = ""
        """Description of the last packet where it cannot be a sample."""
        self.newly_stuck = False
        """Whether the last packet settled that an axis is stuck."""

    def restart(self) -> None:
        """Go on after a new set-up; packets equal to those before it are still repetitions."""
        self._equal = min(self._equal, self._passed)
        self._invalid_in_a_row, self.invalid = 0, ""
        self.newly_stuck = False
        self.stuck.restart()

    @property
    def frozen(self) -> bool:
        """Whether the same packet, or none that is a sample, has come too often."""
        return max(self._equal, self._invalid_in_a_row) >= self._limit

    def jumps(self, words: Words) -> bool:
        """Whether this packet is far from the last one."""
        last = self._last
        if last is None:
            return False
        ax, ay, az, temperature, gx, gy, gz = last
        return not (  # written out: this is done for every sample
            -JUMP <= words[0] - ax <= JUMP
            and -JUMP <= words[1] - ay <= JUMP
            and -JUMP <= words[2] - az <= JUMP
            and -JUMP <= words[3] - temperature <= JUMP
            and -JUMP <= words[4] - gx <= JUMP
            and -JUMP <= words[5] - gy <= JUMP
            and -JUMP <= words[6] - gz <= JUMP
        )

    def usable(self, words: Words) -> bool:
        """Take the next packet; False where it is no sample."""
        if words == self._last:
            self._equal += 1
            if self._equal > self._passed:
                self._counters.repeated_packets += 1
                return False
        elif invalid := _not_a_sample(words):
            self._counters.invalid_packets += 1
            self._invalid_in_a_row += 1
            self.invalid = invalid
            return False
        else:
            self._last, self._equal = words, 1
        self._invalid_in_a_row, self.invalid = 0, ""
        if new := self.stuck.take(words):
            self.newly_stuck = True
            self._counters.stuck_words += len(new)
        return True


def _not_a_sample(words: Words) -> str:
    """Return what a packet is that holds no sample: the bus' idle level, or a chip asleep.

    Accelerations of exactly 0 or -1 counts on three axes do not occur, in free fall neither; a
    bus let go in mid packet leaves them from there on.
    """
    ax, ay, az, temperature, gx, gy, gz = words
    if ax == ay == az and ax in _IDLE:
        return _IDLE[ax]
    if temperature == gx == gy == gz and gx in _IDLE:
        return _IDLE[gx]
    return ""
