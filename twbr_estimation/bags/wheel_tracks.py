"""Wheel angles out of decoded JointStates: which joints, positions or velocities, repaired."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recording import FloatArray, StampArray, WheelTrack
from ..samples import RESTART_GAP
from .cleaning import Cleaner
from .decoding import Columns
from .wheel_repairs import modulus_of, spikes, unwrapped


def wheel_columns(
    topic: str, columns: Columns, joints: tuple[str, ...], repairs: Counter[str]
) -> Columns:
    """Return the angles [rad] of the wheels that the messages give.

    Args:
        topic: for what is counted.
        columns: positions of the wheel joints and of the joint of a single wheel, then their
            velocities.
        joints: one wheel joint, or two as left, right.
        repairs: what is left out or integrated is counted here.
    """
    number = len(joints) + 1
    positions, velocities = columns.values[:, :number], columns.values[:, number:]
    if np.all(np.isnan(positions)):
        angles = _integrated(topic, columns.stamps, velocities, repairs)
    else:
        angles = positions
    present = ~np.all(np.isnan(angles), axis=0)
    if not present.any():
        raise RecordingError(
            f"{topic}: positions and velocities of {', '.join(joints)} are missing or no numbers "
            "in every message; an empty `topics.joint_states` leaves it out"
        )
    chosen = np.flatnonzero(present[:-1])
    if not chosen.size:
        chosen = np.flatnonzero(present)
    elif chosen.size < len(joints):
        missing = ", ".join(joints[i] for i in np.flatnonzero(~present[:-1]))
        repairs[f"{topic}: messages without {missing}; the other wheel used alone"] += (
            columns.stamps.size
        )
    columns = replace(columns, values=angles[:, chosen])
    if chosen.size > 1 and not np.any(np.all(np.isfinite(columns.values), axis=1)):
        columns = _one_wheel(topic, columns, joints, repairs)
    return columns


def _one_wheel(
    topic: str, columns: Columns, joints: tuple[str, ...], repairs: Counter[str]
) -> Columns:
    """Keep one wheel of two that never share a message: which belong together is unknown."""
    first = np.isfinite(columns.values[:, 0])
    why = f"messages without {joints[0]} dropped; no message holds both wheels"
    columns = Cleaner(topic, repairs).keep(columns, first, why)
    return replace(columns, values=columns.values[:, :1])


def _integrated(
    topic: str, stamps: StampArray, velocities: FloatArray, repairs: Counter[str]
) -> FloatArray:
    """Return angles [rad] from velocities [rad/s], (n, wheels); NaN where there is none."""
    angles = np.full(velocities.shape, np.nan)
    for wheel in range(velocities.shape[1]):
        known = np.isfinite(velocities[:, wheel])
        if known.any():
            angles[known, wheel] = integrated(stamps[known], velocities[known, wheel])
    repairs[f"{topic}: wheel angles integrated from velocities"] += stamps.size
    return angles


def rolled(topic: str, columns: Columns, repairs: Counter[str]) -> WheelTrack:
    """Return the distance that the forward speeds [m/s] of an odometry add up to."""
    repairs[f"{topic}: distance rolled integrated from speeds"] += columns.stamps.size
    distance = integrated(columns.stamps, columns.values[:, 0])
    return WheelTrack(columns.stamps, distance[:, None], is_distance=True)


def integrated(stamps: StampArray, velocity: FloatArray) -> FloatArray:
    """Return the angle [rad] from 0 on that velocities [rad/s] add up to.

    By the trapezoidal rule, in the order of the stamps [ns]. Its error is that of the velocities:
    a scale error is one of the angle, an offset grows with time, and of a turn that changes at
    `a` [rad/s^3] each period T adds at most a T^3 / 12. Across a gap the wheel stands still.
    """
    order = np.argsort(stamps, kind="stable")
    ordered = velocity[order]
    periods = np.diff(stamps[order]) * 1e-9
    steps = 0.5 * (ordered[1:] + ordered[:-1]) * np.where(periods <= RESTART_GAP, periods, 0.0)
    angle = np.empty(velocity.size)
    angle[order] = np.concatenate([[0.0], np.cumsum(steps)])[: velocity.size]
    return angle


def repaired_wheels(topic: str, wheels: WheelTrack, repairs: Counter[str]) -> WheelTrack:
    """Return wheels [rad] without wraps and without readings that jumped away and back."""
    cleaner = Cleaner(topic, repairs)
    angle = wheels.angle.copy()
    away = np.zeros(wheels.stamps.size, dtype=np.bool_)
    for wheel in range(angle.shape[1]):
        valid = np.ones(away.size, dtype=np.bool_)
        inside = _usual(angle[:, wheel])
        modulus = modulus_of(wheels.stamps[inside], angle[inside, wheel])
        if modulus is not None:
            valid = inside
            angle[valid, wheel], number = unwrapped(angle[valid, wheel], modulus)
            cleaner.count(f"wheel angle wraps at {modulus:.6g} rad, steps undone", number)
        away |= ~valid
        away[valid] |= spikes(wheels.stamps[valid], angle[valid, wheel])
    cleaner.count("wheel readings that jump away and back dropped", int(np.count_nonzero(away)))
    if not away.any() and np.array_equal(angle, wheels.angle):
        return wheels
    return WheelTrack(wheels.stamps[~away], angle[~away])


def _usual(readings: FloatArray) -> NDArray[np.bool_]:
    """Return which readings lie where most do."""
    low, middle, high = np.percentile(readings, (5.0, 50.0, 95.0))
    usual: NDArray[np.bool_] = np.abs(readings - middle) <= 1.5 * (high - low)
    return usual
