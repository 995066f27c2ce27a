"""Gain of the gyro, and delay of the reference, from the two rates.

The reference stamped t - D belongs to the gyro reading stamped t. Smoothed alike,

    reference rate = k (gyro + D d gyro/dt) - bias,

which is linear; it is solved again with the reference shifted by the D found so far.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .regression import regress
from .signals import Signals

BLOCK = 2.0
"""Residuals this far apart [s] count as independent."""
_ROUNDS = 3


@dataclass(frozen=True, slots=True)
class GyroFit:
    """Result of comparing gyro and reference."""

    gain: float
    """True rate over calibrated rate."""
    gain_error: float
    delay: float
    """The reference stamped t - delay belongs to the gyro reading stamped t [s]."""
    delay_error: float


UNRELATED = GyroFit(0.0, 0.0, 0.0, math.inf)
"""Where the reference stays as it is, or no reading of the gyro is usable."""


def fit_gyro(drives: Sequence[Signals], width: float) -> GyroFit:
    """Estimate gain and delay from drives of one robot, smoothed over `width` [s].

    `UNRELATED` where they have nothing in common.
    """
    delay = 0.0
    for _ in range(_ROUNDS):
        designs, targets, blocks = [], [], []
        for index, drive in enumerate(drives):
            rows = drive.rows(drive.gyro_usable, width)
            terms = (
                drive.smooth(drive.gyro, width),
                drive.smooth(drive.gyro, width, 1),
                np.ones(drive.time.size),
            )
            designs.append(np.column_stack(terms)[rows])
            targets.append(drive.smooth(drive.tilt(delay), width, 1)[rows])
            blocks.append(np.floor(drive.time[rows] / BLOCK) + 1e6 * index)
        if sum(target.size for target in targets) == 0:
            return UNRELATED
        fit = regress(np.vstack(designs), np.concatenate(targets), np.concatenate(blocks))
        gain, lag = float(fit.values[0]), float(fit.values[1])
        if gain == 0.0:
            return UNRELATED
        delay += lag / gain
    return GyroFit(gain, float(fit.errors[0]), delay, float(fit.errors[1]) / abs(gain))
