"""Whether the length of the specific force shows that a gyro turns the wrong way.

A robot that accelerates deflects the specific force from the vertical without leaning, and while
it balances, the accelerometer's tilt often moves against the body's. The directions alone cannot
distinguish that from a wrong sign. The length can: it stays the same where the body leans, and
grows by 1 / cos(deflection) where it accelerates. The deflection is the gyro's turn less the
change of the accelerometer's tilt; with the other sign of the gyro it is another one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Protocol

BLOCK = 0.1
"""Time over which readings are averaged [s]."""
WINDOW = 20
"""Blocks that are looked at together."""
OPPOSITE = 0.3
"""Ratio of the gyro's turn to the accelerometer's from which on a sign can be judged."""
CONFIRMED = 3
"""Blocks in a row after which a wrong sign is believed."""

BETTER = 2.0
"""Ratio of the misfits from which on the other sign explains the length better."""
FITTING = 0.06
"""Largest misfit of the other sign, as a share of gravity: with more, neither explains it."""
LARGEST_DEFLECTION = 1.2
"""Deflections are limited to this [rad]."""
LARGEST_MEAN = 0.3
"""Limit of the unknown mean deflection [rad]."""


class Block(Protocol):
    """Means of a short time."""

    @property
    def shown(self) -> float:
        """Change of the accelerometer's tilt since the block before [rad]."""

    @property
    def turned(self) -> float:
        """The same of the gyro's."""

    @property
    def planar(self) -> float:
        """Length of the specific force in the plane of the tilt, in the accelerometer's unit."""


class SignWatch:
    """Follows from block to block whether a swing shows that the gyro has the wrong sign."""

    def __init__(self) -> None:
        """Start without a past."""
        self._seen = 0

    def wrong(self, ratio: float, blocks: Sequence[Block]) -> bool:
        """Return whether the sign is wrong for sure.

        Args:
            ratio: of the gyro's turn to the accelerometer's; 0 where that is not clear.
            blocks: the latest ones, of which the last is new.
        """
        seen = ratio < -OPPOSITE and _shown(blocks, 1.0)
        self._seen = self._seen + 1 if seen else 0
        return self._seen >= CONFIRMED


def shows_right_sign(ratio: float, blocks: Sequence[Block]) -> bool:
    """Return whether a swing shows that the gyro has the right sign; as for `SignWatch.wrong`."""
    return ratio > OPPOSITE and _shown(blocks, -1.0)


def _shown(blocks: Sequence[Block], sign: float) -> bool:
    """Return whether a gyro times `sign` would have the wrong sign."""
    turned = [sign * each.turned for each in blocks]
    return shows_wrong_sign(
        [each.shown for each in blocks], turned, [each.planar for each in blocks]
    )


def shows_wrong_sign(
    shown: Sequence[float], turned: Sequence[float], lengths: Sequence[float]
) -> bool:
    """Return whether the length fits a gyro of the other sign, and this one much worse.

    Args:
        shown: changes of the accelerometer's tilt from block to block [rad], (n,).
        turned: changes of the gyro's tilt [rad], (n,).
        lengths: mean length of the specific force in the plane of the tilt, in any unit, (n,).
    """
    given, other = misfits(list(accumulate(shown)), list(accumulate(turned)), lengths)
    return other < FITTING and given > BETTER * other


def misfits(
    lean: Sequence[float], turn: Sequence[float], lengths: Sequence[float]
) -> tuple[float, float]:
    """Return the misfit of the lengths with the gyro's sign as it is, and with the other one.

    Args:
        lean: the accelerometer's tilt, apart from a constant [rad], (n,).
        turn: the gyro's [rad], (n,).
        lengths: mean length of the specific force in the plane of the tilt, in any unit, (n,).
    """
    given = misfit(lengths, [b - a for a, b in zip(lean, turn, strict=True)])
    return given, misfit(lengths, [-b - a for a, b in zip(lean, turn, strict=True)])


def misfit(lengths: Sequence[float], deflections: Sequence[float]) -> float:
    """Return how far lengths are from those that deflections explain, rms as a share of gravity.

    The scale of the accelerometer and the mean deflection are unknown and fitted.

    Args:
        lengths: of the specific force, in any unit, (n,).
        deflections: from the vertical, apart from their mean [rad], (n,).
    """
    count = len(lengths)
    mean = sum(deflections) / count
    known = [min(max(each - mean, -LARGEST_DEFLECTION), LARGEST_DEFLECTION) for each in deflections]
    scale = sum(lengths) / count
    if scale == 0.0:
        return math.inf
    rest = [
        each / scale - 1.0 / math.cos(angle) for each, angle in zip(lengths, known, strict=True)
    ]
    level, power = sum(rest) / count, sum(each * each for each in known)
    both = sum(each * (value - level) for each, value in zip(known, rest, strict=True))
    slope = min(max(both / power, -LARGEST_MEAN), LARGEST_MEAN) if power > 0.0 else 0.0
    left = (value - level - slope * each for each, value in zip(known, rest, strict=True))
    return math.sqrt(sum(each * each for each in left) / count)
