"""Parts of a drive in which the wheels do not roll as the IMU moves: lifted, carried, slip."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..recording import FloatArray
from ..robot import Robot
from .evidence import BoolArray
from .finding import Finding, Severity
from .rows import BLOCK, Rows, predicted

CONTRADICTING = 0.4
"""A block contradicts if this share of its largest signal is left."""
LEAST_LEFT = 0.15
"""Less than this is no contradiction [m/s^2]."""
ABOVE_NOISE = 2.0
"""And less than this many times the noise of the wheels' readings is none."""
IN_A_ROW = 2
"""Blocks one after the other that are worth a warning; single ones are bumps and short slips."""
IN_ALL = 4
"""Contradicting blocks in all that are worth a warning."""
SHARE = 0.2
"""And their share of all blocks."""
IN_THE_HAND = 0.6
"""Vertical acceleration that no robot on a floor has in half of the blocks that agree [m/s^2]."""
LEAST_MOTION = 0.1
"""A block without a signal of this size is rest [m/s^2]."""
STANDING = 1e-3
"""Rate of wheels whose readings do not change, after the band [rad/s]."""
MOSTLY = 0.6
"""Share of a block in which they must not change; the band reaches beyond its ends."""
_LEAST_ROWS = 20


def stretches(rows: Rows, robot: Robot, noise: float = 0.0) -> Iterator[Finding]:
    """Yield when wheels and IMU move differently although they agree in the whole.

    Args:
        rows: the motion, without clipped readings.
        robot: as configured.
        noise: of the wheels' readings as acceleration [m/s^2]; what it leaves is no slip.
    """
    blocks, left, shown, lifting = _block_sizes(rows, robot)
    wrong = (left > CONTRADICTING * shown) & (left > max(LEAST_LEFT, ABOVE_NOISE * noise))
    if (hand := _in_the_hand(lifting[~wrong & (shown > LEAST_MOTION)])) > 0.0:
        text = (
            f"not looked at for slip: the IMU moves up and down by {hand:.2g} m/s^2, as in a hand"
        )
        yield Finding(Severity.SKIP, "wheels", "rolling", text)
        return
    begin, count = _longest_run(blocks, wrong)
    if count < IN_A_ROW and not (wrong.sum() >= IN_ALL and wrong.mean() > SHARE):
        return
    total = BLOCK * float(wrong.sum())
    what = "the robot was lifted, carried, held or lay there, or its wheels slipped"
    if _standing(rows)[wrong].mean() > 0.5:
        what = "their angles stay the same: encoders or cable are dead there, or the robot was held"
    text = (
        f"they do not roll as the IMU moves for {total:.0f} s of {BLOCK * blocks.size:.0f} s, most "
        f"of it from {begin:.0f} s to {begin + BLOCK * count:.0f} s: {what}; leave this part out"
    )
    yield Finding(Severity.WARN, "wheels", "rolling", text, float(wrong.mean()))


def _in_the_hand(lifting: FloatArray) -> float:
    """Return the usual vertical acceleration if it is that of a hand, else 0 [m/s^2]."""
    usual = float(np.median(lifting)) if lifting.size >= IN_ALL else 0.0
    return usual if usual > IN_THE_HAND else 0.0


def _block_sizes(rows: Rows, robot: Robot) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return for each block its number and [m/s^2] what is left, largest and vertical signal."""
    force = rows.force[:, 0]
    gyro, wheels = predicted(rows, robot)
    numbers, members = np.unique(rows.blocks, return_inverse=True)
    sizes = np.bincount(members)

    def size(values: FloatArray) -> FloatArray:
        root: FloatArray = np.sqrt(np.bincount(members, np.square(values)) / sizes)
        return root

    left = size(force - gyro - wheels)
    shown = np.maximum(size(force), np.maximum(size(gyro), size(wheels)))
    kept = sizes >= _LEAST_ROWS
    return numbers[kept], left[kept], shown[kept], size(rows.force[:, 2])[kept]


def _standing(rows: Rows) -> BoolArray:
    """Return for each block whether the encoders' readings stay the same in nearly all of it."""
    assert rows.wheel_rates is not None
    numbers, members = np.unique(rows.blocks, return_inverse=True)
    sizes = np.bincount(members, minlength=numbers.size)
    still = np.abs(rows.wheel_rates).max(axis=1) < STANDING
    standing: BoolArray = np.bincount(members, still) > MOSTLY * sizes
    return standing[sizes >= _LEAST_ROWS]


def _longest_run(blocks: FloatArray, wrong: BoolArray) -> tuple[float, int]:
    """Return where the longest run of wrong blocks begins [s], and its length."""
    best, begin, length = (0.0, 0), 0.0, 0
    for index, (block, bad) in enumerate(zip(blocks, wrong, strict=True)):
        follows = length > 0 and block - blocks[index - 1] == 1.0
        length = (length + 1 if follows else 1) if bad else 0
        begin = block if length == 1 else begin
        best = max(best, (begin, length), key=lambda each: each[1])
    return BLOCK * (best[0] % 1e6), best[1]
