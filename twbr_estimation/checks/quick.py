"""Gross contradictions within two seconds, sample by sample: a dead sensor, a wrong unit or sign.

The tilt that the gyro turns is compared with the tilt that the accelerometer shows, in blocks of
`BLOCK`, over the last `WINDOW`. A robot's own acceleration disturbs the latter, so that only gross
contradictions count, and a sign only where the length of the force shows that the robot leans,
or where the wheels show the acceleration.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..samples import RESTART_GAP, STANDARD_GRAVITY, CorrectedSample
from .finding import Finding, Severity
from .rolling import RollingCheck
from .swing import BLOCK, WINDOW, SignWatch, shows_right_sign
from .units import of_accelerometer

if TYPE_CHECKING:  # a node that filters starts without recordings
    from ..recording import FloatArray

MOVING = 0.02
"""Change of the tilt from block to block, rms [rad], from which on the robot moves."""
CLEAR = 0.7
"""Correlation of gyro and accelerometer from which on their ratio means something."""
IN_DEGREES = 20.0
"""Ratio of the turns above which the gyro reports degrees; exactly it would be 57.3."""
TURNS = "its y axis turns {:.3g} times as far as the accelerometer's x axis leans"
GRAVITY_TOLERANCE = 0.3
"""Share by which the mean specific force may differ from gravity."""
NO_FORCE = (0.4, 2.5)
"""Ratios of the mean specific force to gravity beyond which it is in another unit. With g for
m/s^2 and a bias in m/s^2 taken off, the ratio is between 0.04 and 0.2."""


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
    planar: float
    """The same of its part in the plane of the tilt."""
    up: float
    """Mean force along z [m/s^2]."""


class QuickChecks:
    """Check of corrected samples; reports readings that contradict each other."""

    def __init__(self) -> None:
        """Start without a past."""
        self.untrusted: tuple[Finding, ...] = ()
        """Findings that make the tilt wrong."""
        self.doubts: tuple[Finding, ...] = ()
        """Other findings."""
        self._blocks: deque[_Block] = deque(maxlen=WINDOW)
        self._turn = 0.0
        self._last: tuple[float, float] | None = None
        self._forget()
        self._begin()

    def _forget(self) -> None:
        self._sign, self._rolling = SignWatch(), RollingCheck()
        self._contradiction: Finding | None = None
        self._other_unit: Finding | None = None

    def _begin(self) -> None:
        self._time = self._shown = self._turned = self._length = self._planar = self._up = 0.0
        self._count = 0
        self._least_rate = self._least_force = math.inf
        self._most_rate = self._most_force = -math.inf

    def restart(self) -> None:
        """Forget everything, because time has jumped."""
        self._blocks.clear()
        self._last, self.untrusted, self.doubts = None, (), ()
        self._forget()
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
        planar = x * x + z * z
        self._planar += math.sqrt(planar)
        self._length += math.sqrt(planar + sample.accel_y * sample.accel_y)
        self._up += z
        if sample.wheel_count > 0.0:
            self._rolling.add(sample, self._turn)
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
                    self._planar / self._count,
                    self._up / self._count,
                )
            )
        self._last = shown, turned
        self._rolling.end_block(self._count)
        self._begin()
        if len(self._blocks) == WINDOW:
            gravity = self._gravity()
            found = self._dead(), self._contradicting(), self._unit(gravity)
            self.untrusted = tuple(filter(None, found))
            self.doubts = tuple(filter(None, (gravity, self._direction())))

    def _dead(self) -> Finding | None:
        """Return which sensor stands still although the other moves."""
        blocks = self._blocks
        shown = math.sqrt(sum(each.shown * each.shown for each in blocks) / WINDOW)
        turned = math.sqrt(sum(each.turned * each.turned for each in blocks) / WINDOW)
        rate = blocks[-1].rate[0]
        if all(each.rate == (rate, rate) for each in blocks) and shown > MOVING:
            seen = f"axis y reads {rate:.4g} rad/s and nothing else while the accelerometer swings"
            return Finding(Severity.FAIL, "gyro", "dead axis", f"{seen}: it is dead or stuck")
        force = blocks[-1].force[0]
        if all(each.force == (force, force) for each in blocks) and turned > MOVING:
            seen = f"axis x reads {force:.4g} m/s^2 and nothing else while the gyro turns"
            return Finding(
                Severity.FAIL, "accelerometer", "dead axis", f"{seen}: it is dead or stuck"
            )
        return None

    def _contradicting(self) -> Finding | None:
        """Return how gyro and accelerometer contradict each other.

        What was found stays until the opposite is: a robot whose motors were cut shows nothing.
        """
        ratio, known = self._ratio(), self._contradiction
        if ratio > IN_DEGREES:
            text = f"{TURNS.format(ratio)}: it looks like deg/s; give rad/s"
            known = Finding(Severity.FAIL, "gyro", "unit", text, ratio)
        elif self._sign.wrong(ratio, self._blocks):
            text = f"{TURNS.format(ratio)}: one of both has the wrong sign; check robot.mounting"
            known = Finding(Severity.FAIL, "gyro", "sign", text, ratio, "robot.mounting")
        elif self._rolling.wrong is not None:
            known = self._rolling.wrong
        elif known is not None and _shown_by_swing(known) and shows_right_sign(ratio, self._blocks):
            known = None
        self._contradiction = None if self._rolling.right else known
        return self._contradiction

    def _ratio(self) -> float:
        """Return how far the gyro turns while the accelerometer's tilt does; 0 if not clear."""
        shown = sum(each.shown * each.shown for each in self._blocks)
        turned = sum(each.turned * each.turned for each in self._blocks)
        both = sum(each.shown * each.turned for each in self._blocks)
        clear = (
            shown >= WINDOW * MOVING**2
            and turned > 0.0
            and abs(both) >= CLEAR * math.sqrt(shown * turned)
        )
        return both / shown if clear else 0.0

    def _gravity(self) -> Finding | None:
        length = sum(each.length for each in self._blocks) / WINDOW
        ratio = length / STANDARD_GRAVITY
        unit = of_accelerometer(ratio)
        if abs(ratio - 1.0) <= GRAVITY_TOLERANCE:
            return None
        reads = f"its mean reading is {length:.3g} where gravity is {STANDARD_GRAVITY:.3g} m/s^2"
        advice = (
            f"it is in {unit}; give m/s^2"
            if unit
            else "check the full scale the driver assumes and calibration.accel_bias"
        )
        return Finding(Severity.FAIL, "accelerometer", "unit", f"{reads}: {advice}", ratio)

    def _unit(self, gravity: Finding | None) -> Finding | None:
        """Return the other unit that the accelerometer has, until its mean reading is gravity."""
        if gravity is None:
            self._other_unit = None
        elif gravity.ratio is not None and not NO_FORCE[0] < gravity.ratio < NO_FORCE[1]:
            self._other_unit = gravity
        return self._other_unit

    def _direction(self) -> Finding | None:
        if not all(each.up < -0.5 * each.length for each in self._blocks):
            return None
        text = "its z axis points down: check robot.mounting, or the robot is upside down"
        return Finding(Severity.FAIL, "accelerometer", "direction", text, -1.0, "robot.mounting")


def _shown_by_swing(found: Finding) -> bool:
    """Return whether a swing can show that this is no longer so: no unit of the accelerometer."""
    return found.check != "unit" or (found.ratio or 0.0) > IN_DEGREES


def contradicted(samples: FloatArray) -> NDArray[np.bool_]:
    """Return at which samples a live stream would find that the tilt cannot be right, (n,).

    Args:
        samples: the fields of n corrected samples, (fields, n).
    """
    checks, found = QuickChecks(), np.zeros(samples.shape[1], dtype=np.bool_)
    for index, values in enumerate(samples.T.tolist()):
        checks.add(CorrectedSample._make(values))
        found[index] = bool(checks.untrusted)
    return found
