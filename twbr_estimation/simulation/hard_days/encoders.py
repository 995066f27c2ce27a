"""Days on which the encoders do not count as the setup says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...recording import FloatArray, WheelTrack
from ..simulate import Simulated, simulate
from .day import Day, Maker

DURATION = 60.0
WORLDS = ("W2", "W4")

Change = Callable[[FloatArray, FloatArray], FloatArray]
"""From the time [s] and the encoder angles [rad], (n, w), to other angles."""


def _driven(seed: int, period: float, change: Change, *, world: str = "") -> Day:
    made = simulate(world or WORLDS[seed % 2], period, DURATION, seed)
    return _changed(made, change)


def _changed(made: Simulated, change: Change) -> Day:
    wheels, truth = made.recording.wheels, made.recording.truth
    assert wheels is not None and truth is not None
    time = (wheels.stamps - wheels.stamps[0]) * 1e-9
    track = WheelTrack(wheels.stamps, change(time, wheels.angle))
    return Day(replace(made.recording, wheels=track), made.setup)


def _times(factor: float, time: FloatArray, angle: FloatArray) -> FloatArray:
    del time
    return factor * angle


def _coarse(counts: int, time: FloatArray, angle: FloatArray) -> FloatArray:
    del time
    quantum = math.tau / counts
    return np.asarray(np.floor(angle / quantum) * quantum)


def _left_frozen(time: FloatArray, angle: FloatArray) -> FloatArray:
    during = (time >= 20.0) & (time < 40.0)
    changed = angle.copy()
    first, last = angle[during, 0][0], angle[during, 0][-1]
    changed[during, 0] = first
    changed[time >= 40.0, 0] -= last - first
    return changed


def _left_mirrored(time: FloatArray, angle: FloatArray) -> FloatArray:
    del time
    return angle * (-1.0, 1.0)


def _late(delay: float, time: FloatArray, angle: FloatArray) -> FloatArray:
    return np.stack([np.interp(time - delay, time, each) for each in angle.T], axis=1)


def _factor(seed: int, period: float, *, low: float, high: float) -> Day:
    factor = float(np.random.default_rng([seed, 11]).uniform(low, high))
    return _driven(seed, period, partial(_times, factor))


def _delayed(seed: int, period: float) -> Day:
    delay = float(np.random.default_rng([seed, 12]).uniform(0.02, 0.06))
    return _driven(seed, period, partial(_late, delay))


DAYS: dict[str, Maker] = {
    "encoder signs wrong": partial(_factor, low=-1.0, high=-1.0),
    "counts doubled": partial(_factor, low=1.8, high=2.5),
    "counts halved": partial(_factor, low=0.4, high=0.6),
    "degrees for radians": partial(_factor, low=180.0 / math.pi, high=180.0 / math.pi),
    "left encoder frozen": partial(_driven, change=_left_frozen, world="W4"),
    "left encoder mirrored": partial(_driven, change=_left_mirrored, world="W4"),
    "48 counts a turn": partial(_driven, change=partial(_coarse, 48)),
    "200 counts a turn": partial(_driven, change=partial(_coarse, 200)),
    "encoder 20 to 60 ms late": _delayed,
}
