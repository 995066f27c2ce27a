"""Stamps of a recording whose senders have another clock than this computer, or none."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..samples import NANOSECONDS_PER_SECOND, Stamps
from .decoding import Columns
from .message_batch import IntArray

RESTART = NANOSECONDS_PER_SECOND
"""A step back by more [ns] is a new start of the device."""
LARGEST_DRIFT = 0.02
"""Largest relative error of a device's rate."""


def restamped(topic: str, columns: Columns, stamps: Stamps, repairs: Counter[str]) -> Columns:
    """Return the messages of a topic with the stamps that count.

    Args:
        topic: For what is counted.
        columns: Messages in the order of the file.
        stamps: `ARRIVAL` takes the recorder's times, which hold the jitter of the connection.
            `DEVICE` relates the senders' stamps to them: recorded minus sent is the offset of
            the clocks plus a delay, so its lower envelope, a straight line from start to start of
            the device, is the offset plus the shortest delay. Messages with stamp 0 stay so.
        repairs: What is done is counted here.
    """
    if stamps is Stamps.HEADER:
        return columns
    if stamps is Stamps.ARRIVAL:
        repairs[f"{topic}: stamped with the time of recording"] += columns.stamps.size
        return replace(columns, stamps=columns.bag_times)
    order = np.argsort(columns.bag_times, kind="stable")
    known = order[columns.stamps[order] > 0]
    found = columns.stamps.copy()
    starts = np.flatnonzero(np.diff(columns.stamps[known]) < -RESTART) + 1
    for part in np.split(known, starts):
        if part.size:
            found[part] = _related(columns.stamps[part], columns.bag_times[part])
    repairs[f"{topic}: stamps related to the time of recording"] += known.size
    if starts.size:
        repairs[f"{topic}: starts of the device's clock"] += starts.size
    return replace(columns, stamps=found)


def _related(device: IntArray, recorded: IntArray) -> IntArray:
    """Return the device's stamps on the recorder's clock [ns]."""
    passed = device - device[0]
    offset = recorded - device
    later = (offset - offset[0]).astype(np.float64)
    drift, at_start = _lower_line(passed.astype(np.float64), later)
    shift: IntArray = np.rint(at_start + drift * passed).astype(np.int64)
    related: IntArray = device + offset[0] + shift
    return related


def _lower_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return slope and value at 0 of the line below all points that is nearest to them.

    It is the edge of the lower hull at the mean of `x`. A slope that no clock has is not used: then
    the line is level, through the lowest point.
    """
    hull: list[int] = []
    for point in np.lexsort((y, x)).tolist():
        if hull and x[hull[-1]] == x[point]:
            continue
        while len(hull) > 1 and _turns_down(x, y, hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle = float(np.mean(x))
    for left, right in pairwise(hull):
        if x[left] <= middle <= x[right]:
            slope = float((y[right] - y[left]) / (x[right] - x[left]))
            if abs(slope) <= LARGEST_DRIFT:
                return slope, float(y[left] - slope * x[left])
    return 0.0, float(np.min(y))


def _turns_down(x: np.ndarray, y: np.ndarray, first: int, middle: int, last: int) -> bool:
    """Whether the middle point lies on or above the line from the first to the last."""
    rise = (y[middle] - y[first]) * (x[last] - x[first])
    return bool(rise >= (y[last] - y[first]) * (x[middle] - x[first]))
