"""Repairs of wheel angles that wrap, or jump away and come back.

Absolute encoders and simulators report an angle within one turn, timers count up to a power of
two: at the end of the range the reading steps to its other end. Such steps are recognised by
what they have in common: all are about as large as the range that the readings fill, and no
other step is nearly as large. They are undone, since a wheel cannot turn that far in one sample.

A damaged telegram makes readings jump away and back within a few samples, which no wheel does
either; these readings are dropped.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..recording import FloatArray, StampArray

TURNS = (2.0 * math.pi, 360.0, math.pi, 4.0 * math.pi)
"""Ranges of angles that are known to wrap [rad or, unconverted, deg]."""
COUNTERS = tuple(float(1 << bits) for bits in (8, 10, 12, 14, 15, 16, 17, 18, 20, 24, 31, 32))
"""Ranges of counters that are known to wrap [counts]."""
_OUTSTANDING = 20.0
"""Least ratio of a step that is repaired to the usual steps."""
_FILLED, _OVERFULL = 0.9, 1.001
"""Share of a range that readings fill if they wrap at its ends."""
_WRAPPED = 0.6
"""A step of more than this share of a range is a wrap; one of less than the rest of it is not."""
_PLATEAU = 5
"""Most samples for which a reading may stay away."""
_FASTEST = 100.0
"""A wheel that turns faster [rad/s] than this in one sample may be a damaged reading."""
_NORMAL_PERIODS = 3.0
"""Steps over more median periods than this are gaps, in which a wheel may turn far."""


def modulus_of(
    stamps: StampArray,
    angle: FloatArray,
    known: Sequence[float] = TURNS,
    fastest: float = 0.4 * _FASTEST,
) -> float | None:
    """Return the range at whose ends readings wrap; None where they do not.

    Args:
        stamps: when the readings were taken [ns], (n,), increasing.
        angle: one wheel's readings, (n,).
        known: ranges that readings may wrap at, in the unit of `angle`; another range counts
            where all the steps are alike.
        fastest: steps that take less speed than this [unit of `angle` / s] are none.
    """
    if angle.size < 4:
        return None
    steps = np.diff(angle)
    near = _near(stamps) & (np.abs(steps) > fastest * np.diff(stamps) * 1e-9)
    extent = float(np.ptp(angle))
    for range_ in known:
        if not _FILLED * range_ <= extent <= _OVERFULL * range_:
            continue
        share = np.abs(steps[near]) / range_
        if np.any(share > _WRAPPED) and not np.any((share > 1.0 - _WRAPPED) & (share < _WRAPPED)):
            return range_
    low, high = np.percentile(angle, (10.0, 90.0))
    if high - low < 0.5 * extent:  # readings that wrap pass through the whole range
        return None
    return _unknown_modulus(steps, near & _outstanding(stamps, steps), extent)


def _unknown_modulus(steps: FloatArray, large: NDArray[np.bool_], extent: float) -> float | None:
    """Return the range that several large steps have in common with what the readings fill."""
    size = np.abs(steps[large])
    if size.size < 2:
        return None
    alike = float(np.ptp(size)) <= max(_OUTSTANDING * _usual(steps[~large]), 1e-9 * extent)
    if not alike or float(size.min()) < _FILLED * extent:
        return None
    return float(np.median(size + _carried(steps, large)))


def unwrapped(angle: FloatArray, modulus: float) -> tuple[FloatArray, int]:
    """Return readings that go on where they wrapped, and how many steps were undone.

    Args:
        angle: readings, (n,).
        modulus: the range at whose ends they wrap, in the same unit.
    """
    turns = -np.round(np.diff(angle) / modulus)
    whole = np.concatenate([[0.0], np.cumsum(turns)])
    return np.asarray(angle + modulus * whole, dtype=np.float64), int(np.count_nonzero(turns))


def spikes(stamps: StampArray, angle: FloatArray, fastest: float = _FASTEST) -> NDArray[np.bool_]:
    """Return which readings jumped away from both what came before and what came after.

    Args:
        stamps: when the readings were taken [ns], (n,), increasing.
        angle: one wheel's readings, (n,).
        fastest: steps that take less speed than this [unit of `angle` / s] are none.
    """
    away = np.zeros(angle.size, dtype=np.bool_)
    if angle.size < 4:
        return away
    steps = np.diff(angle)
    seconds = np.maximum(np.diff(stamps) * 1e-9, 1e-9)
    large = _outstanding(stamps, steps) & (np.abs(steps) > fastest * seconds)
    limit = _OUTSTANDING * _usual(steps[~large])
    edges = np.flatnonzero(large).tolist()
    last = -1
    for edge in edges:
        if edge <= last:
            continue
        stop = min(edge + 1 + _PLATEAU, angle.size - 1)
        back = np.abs(angle[edge + 2 : stop + 1] - angle[edge])
        near = back <= limit * np.arange(2, back.size + 2)
        returns = np.flatnonzero(near & large[edge + 1 : stop])
        if returns.size:
            last = edge + 1 + int(returns[0])
            away[edge + 1 : last + 1] = True
    return away


def _outstanding(stamps: StampArray, steps: FloatArray) -> NDArray[np.bool_]:
    """Return which steps between neighbours in time are far larger than usual."""
    if steps.size < 3:
        return np.zeros(steps.size, dtype=np.bool_)
    outstanding: NDArray[np.bool_] = _near(stamps) & (np.abs(steps) > _OUTSTANDING * _usual(steps))
    return outstanding


def _near(stamps: StampArray) -> NDArray[np.bool_]:
    """Return which steps are between neighbours, not over a gap."""
    periods = np.diff(stamps)
    near: NDArray[np.bool_] = periods <= _NORMAL_PERIODS * np.median(periods)
    return near


def _usual(steps: FloatArray) -> float:
    """Return the size that nine in ten steps keep to, at least one count of the encoder."""
    sizes = np.abs(steps)
    moving = sizes[sizes > 0.0]
    if not moving.size:
        return 0.0
    return max(float(np.percentile(sizes, 90.0)), float(moving.min()))


def _carried(steps: FloatArray, large: NDArray[np.bool_]) -> FloatArray:
    """Return how far the wheel itself turned in each wrapped step, as in the step before."""
    where = np.flatnonzero(large)
    before = np.where(large[np.maximum(where - 1, 0)], 0.0, steps[np.maximum(where - 1, 0)])
    carried: FloatArray = -np.sign(steps[where]) * before
    return carried
