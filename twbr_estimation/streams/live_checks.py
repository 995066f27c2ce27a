"""Readings that contradict each other while the robot moves: a dead sensor, a wrong unit or sign.

The tilt that the gyro turns is compared with the tilt that the accelerometer shows, in blocks of
`BLOCK`, over the last `WINDOW`. A robot's own acceleration disturbs the latter, so that only gross
contradictions count.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from ..samples import RESTART_GAP, STANDARD_GRAVITY, CorrectedSample

BLOCK = 0.1
"""Time over which readings are averaged [s]."""
WINDOW = 20
"""Blocks that are looked at together."""
MOVING = 0.02
"""Change of the tilt from block to block, rms [rad], from which on the robot moves."""
CLEAR = 0.7
"""Correlation of gyro and accelerometer from which on their ratio means something."""
IN_DEGREES = 20.0
"""Ratio of the turns above which the gyro reports degrees; exactly it would be 57.3."""
IN_G = (0.5, 2.0)
"""Length of the specific force that is gravity in g."""
GRAVITY_TOLERANCE = 0.3
"""Share by which the mean specific force may differ from gravity."""


class _Block(NamedTuple):
    shown: float
    """Change of the accelerometer's tilt since the block before [rad]."""
    turned: float
    """The same of the gyro's."""
    rate: tuple[float, float]
    """Smallest and largest rate [rad/s]."""
    force: tuple[float, float]
    """Smallest and largest force along x [m/s^2]."""
    length: float
    """Mean length of the specific force [m/s^2]."""
    up: float
    """Mean force along z [m/s^2]."""


class LiveChecks:
    """Check of corrected samples; reports readings that contradict each other."""

    def __init__(self) -> None:
        """Start without a past."""
        self.untrusted: tuple[str, ...] = ()
        """Findings that make the tilt wrong."""
        self.doubts: tuple[str, ...] = ()
        """Other findings."""
        self._blocks: deque[_Block] = deque(maxlen=WINDOW)
        self._turn = 0.0
        self._last: tuple[float, float] | None = None
        self._begin()

    def _begin(self) -> None:
        self._time = self._shown = self._turned = self._length = self._up = 0.0
        self._count = 0
        self._least_rate = self._least_force = math.inf
        self._most_rate = self._most_force = -math.inf

    def restart(self) -> None:
        """Forget everything, because time has jumped."""
        self._blocks.clear()
        self._last, self.untrusted, self.doubts = None, (), ()
        self._begin()

    def add(self, sample: CorrectedSample) -> None:
        """Take a sample."""
        if sample.dt > RESTART_GAP:
            self.restart()
        rate, x, z = sample.gyro_y, sample.accel_x, sample.accel_z
        self._turn += rate * min(sample.dt, RESTART_GAP)
        self._time += sample.dt
        self._count += 1
        self._shown += math.atan2(-x, z)
        self._turned += self._turn
        self._length += math.sqrt(x * x + sample.accel_y * sample.accel_y + z * z)
        self._up += z
        self._least_rate, self._most_rate = min(self._least_rate, rate), max(self._most_rate, rate)
        self._least_force, self._most_force = min(self._least_force, x), max(self._most_force, x)
        if self._time >= BLOCK:
            self._end_block()

    def _end_block(self) -> None:
        shown, turned = self._shown / self._count, self._turned / self._count
        if self._last is not None:
            change = math.remainder(shown - self._last[0], 2.0 * math.pi)
            self._blocks.append(
                _Block(
                    change,
                    turned - self._last[1],
                    (self._least_rate, self._most_rate),
                    (self._least_force, self._most_force),
                    self._length / self._count,
                    self._up / self._count,
                )
            )
        self._last = shown, turned
        self._begin()
        if len(self._blocks) == WINDOW:
            self.untrusted = tuple(filter(None, (self._dead(), self._ratio())))
            self.doubts = tuple(filter(None, (self._gravity(), self._direction())))

    def _dead(self) -> str:
        """Return which sensor stands still although the other moves."""
        blocks = self._blocks
        shown = math.sqrt(sum(each.shown**2 for each in blocks) / WINDOW)
        turned = math.sqrt(sum(each.turned**2 for each in blocks) / WINDOW)
        rate = blocks[-1].rate[0]
        if all(each.rate == (rate, rate) for each in blocks) and shown > MOVING:
            return (
                f"the gyro's y axis reads {rate:.4g} rad/s and nothing else while the "
                "accelerometer shows a swing: it is dead or stuck"
            )
        force = blocks[-1].force[0]
        if all(each.force == (force, force) for each in blocks) and turned > MOVING:
            return (
                f"the accelerometer's x axis reads {force:.4g} m/s^2 and nothing else while the "
                "gyro turns: it is dead or stuck"
            )
        return ""

    def _ratio(self) -> str:
        """Return what the gyro's unit or sign must be."""
        shown = sum(each.shown**2 for each in self._blocks)
        turned = sum(each.turned**2 for each in self._blocks)
        both = sum(each.shown * each.turned for each in self._blocks)
        if shown < WINDOW * MOVING**2 or abs(both) < CLEAR * math.sqrt(shown * turned):
            return ""
        ratio = both / shown
        if ratio < -0.3:
            return (
                f"the gyro turns {ratio:.2g} times as far as the accelerometer shows: a sign is "
                "wrong; see robot.mounting"
            )
        if ratio > IN_DEGREES:
            return (
                f"the gyro turns {ratio:.3g} times as far as the accelerometer shows: it reports "
                "deg/s where rad/s are needed"
            )
        return ""

    def _gravity(self) -> str:
        length = sum(each.length for each in self._blocks) / WINDOW
        if IN_G[0] < length < IN_G[1]:
            return f"the accelerometer's mean is {length:.3g}: it reports g where m/s^2 are needed"
        if abs(length / STANDARD_GRAVITY - 1.0) > GRAVITY_TOLERANCE:
            return (
                f"the accelerometer's mean is {length:.3g} m/s^2 where gravity is "
                f"{STANDARD_GRAVITY:.3g}; see its range and calibration.accel_bias"
            )
        return ""

    def _direction(self) -> str:
        if all(each.up < -0.5 * each.length for each in self._blocks):
            return "the z axis points down: see robot.mounting, or the robot is upside down"
        return ""
