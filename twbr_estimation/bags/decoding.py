"""Decode batches of serialised messages (XCDR version 1, the format of rosbag2) into columns.

A message starts with four bytes of encapsulation; alignment counts from the byte after
them. Stamp, string length and fields of all messages are gathered at once, so constant and
varying frame ids or lengths are decoded by the same function.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recording import FloatArray
from ..ros_messages import (
    ACCEL,
    ACCEL_COVARIANCE,
    GYRO,
    GYRO_COVARIANCE,
    IMU_DOUBLES,
    ORIENTATION,
    ORIENTATION_COVARIANCE,
    POSE_DOUBLES,
)
from ..samples import NANOSECONDS_PER_SECOND
from .message_batch import IntArray, MessageBatch

IMU_COLUMNS = np.array(
    [
        *range(ORIENTATION, ORIENTATION_COVARIANCE + 1),
        *range(GYRO, GYRO_COVARIANCE + 1),
        *range(ACCEL, ACCEL_COVARIANCE + 1),
    ]
)
"""Of an Imu's doubles the vectors, each followed by the first entry of its covariance."""
ORIENTATION_COLUMNS, ORIENTATION_STATED = slice(0, 4), 4
GYRO_COLUMNS, GYRO_STATED = slice(5, 8), 8
ACCEL_COLUMNS, ACCEL_STATED = slice(9, 12), 12
"""Where the vectors and those entries are among the decoded columns."""
_ORDERS = {0: ">", 1: "<"}


@dataclass(slots=True)
class Columns:
    """Decoded messages of one topic."""

    stamps: IntArray
    """Header stamps, or the bag's times where the type has no header [ns], (n,)."""
    bag_times: IntArray
    """When each message was recorded [ns], (n,)."""
    values: FloatArray
    """The fields asked for, (n, k)."""
    frames: NDArray[np.object_]
    """Frame ids, (n,)."""
    broken: int = 0
    """Messages that were left out because they are too short for their type."""
    names: set[str] = field(default_factory=set)
    """Joint names seen, for messages that have any."""


def decode_imu(batch: MessageBatch) -> Columns:
    """Return orientation (x, y, z, w), gyro and accelerometer, each with its first covariance."""
    whole, order, start, frames = _after_header(batch)
    fits = start + 8 * IMU_DOUBLES <= whole.offsets + whole.sizes
    whole, start = whole.take(fits), start[fits]
    values = whole.at(start[:, None] + 8 * IMU_COLUMNS, f"{order}f8").astype(np.float64)
    broken = batch.offsets.size - start.size
    return Columns(header_stamps(whole, order), whole.bag_times, values, frames[fits], broken)


def decode_temperature(batch: MessageBatch) -> Columns:
    """Return the temperature [degC] of `sensor_msgs/Temperature`."""
    whole, order, start, frames = _after_header(batch)
    fits = start + 8 <= whole.offsets + whole.sizes
    whole, start = whole.take(fits), start[fits]
    values = whole.at(start[:, None], f"{order}f8").astype(np.float64)
    broken = batch.offsets.size - start.size
    return Columns(header_stamps(whole, order), whole.bag_times, values, frames[fits], broken)


def decode_odometry(batch: MessageBatch) -> Columns:
    """Return the forward speed [m/s] of `nav_msgs/Odometry`."""
    whole, order = readable(batch, 16)
    lengths = whole.at(whole.offsets + 12, f"{order}u4").astype(np.int64)
    child = 16 + lengths + -lengths % 4
    fits = child <= whole.sizes - 4
    whole, lengths, child = whole.take(fits), lengths[fits], child[fits]
    child += 4 + whole.at(whole.offsets + child, f"{order}u4").astype(np.int64)
    place = 4 + aligned(child - 4) + 8 * POSE_DOUBLES
    fits = place <= whole.sizes - 8
    whole, lengths, place = whole.take(fits), lengths[fits], place[fits]
    values = whole.at((whole.offsets + place)[:, None], f"{order}f8").astype(np.float64)
    broken = batch.offsets.size - place.size
    stamps, frames = header_stamps(whole, order), _frames(whole, lengths)
    return Columns(stamps, whole.bag_times, values, frames, broken)


def decode_float64(batch: MessageBatch) -> Columns:
    """Return the number of `std_msgs/Float64`, stamped with the bag's time."""
    whole, order = readable(batch, 12)
    values = whole.at(whole.offsets[:, None] + 4, f"{order}f8").astype(np.float64)
    frames = np.full(whole.offsets.size, "", dtype=object)
    broken = batch.offsets.size - whole.offsets.size
    return Columns(whole.bag_times, whole.bag_times, values, frames, broken)


def decode_float64_array(batch: MessageBatch) -> Columns:
    """Return length, first and second number of `std_msgs/Float64MultiArray`.

    Stamped with the bag's time; a number that is not there is NaN, an empty array broken.
    """
    whole, order = readable(batch, 16)
    ends = whole.offsets + whole.sizes
    counts = whole.offsets + 12 + _dimensions(whole, order)
    length = whole.at(np.minimum(counts, ends - 4), f"{order}u4").astype(np.int64)
    first = whole.offsets + 4 + aligned(counts - whole.offsets)
    fits = (length > 0) & (first + 8 * length <= ends)
    whole, length, first = whole.take(fits), length[fits], first[fits]
    places = np.column_stack([first, np.where(length > 1, first + 8, first)])
    numbers = whole.at(places, f"{order}f8").astype(np.float64)
    numbers[length < 2, 1] = np.nan
    frames = np.full(length.size, "", dtype=object)
    broken = batch.offsets.size - length.size
    values = np.column_stack([length, numbers])
    return Columns(whole.bag_times, whole.bag_times, values, frames, broken)


def _dimensions(batch: MessageBatch, order: str) -> IntArray:
    """Return how many bytes the dimensions of each array take; few messages have any."""
    number = batch.at(batch.offsets + 4, f"{order}u4")
    sizes = np.zeros(number.size, dtype=np.int64)
    for index in np.flatnonzero(number).tolist():
        message, at = batch.message(index), 8
        for _ in range(int(number[index])):  # label, size, stride
            at += -at % 4
            label = int.from_bytes(message[at : at + 4], "little" if order == "<" else "big")
            at = at + 4 + label
            at += -at % 4 + 8
            if at > len(message):
                break
        sizes[index] = at - 8
    return sizes


def readable(batch: MessageBatch, least: int) -> tuple[MessageBatch, str]:
    """Return the messages of at least `least` bytes, and their byte order as numpy's sign.

    Messages whose encapsulation is not that of the most are damaged and left out.

    Raises:
        RecordingError: most messages are serialised in another way.
    """
    whole = batch.take(batch.sizes >= least)
    if not whole.offsets.size:
        return whole, "<"
    kinds = whole.at(whole.offsets, ">u2")
    usual, _ = Counter(kinds.tolist()).most_common(1)[0]
    if usual not in _ORDERS:
        raise RecordingError(
            f"messages have encapsulation 0x{usual:04x}; known are 0x0000 and 0x0001"
        )
    return whole.take(kinds == usual), _ORDERS[usual]


def _after_header(batch: MessageBatch) -> tuple[MessageBatch, str, IntArray, NDArray[np.object_]]:
    """Return messages with a whole header, byte order, offset of the next double, frame ids."""
    whole, order = readable(batch, 16)
    lengths = whole.at(whole.offsets + 12, f"{order}u4").astype(np.int64)
    fits = lengths <= whole.sizes - 16
    whole, lengths = whole.take(fits), lengths[fits]
    start = whole.offsets + 4 + aligned(12 + lengths)
    return whole, order, start, _frames(whole, lengths)


def _frames(batch: MessageBatch, lengths: IntArray) -> NDArray[np.object_]:
    frames = np.full(lengths.size, "", dtype=object)
    for length in sorted(set(lengths[lengths > 1].tolist())):
        where = np.flatnonzero(lengths == length)
        text = bytes_at(batch, batch.offsets[where] + 16, length - 1)
        first = text[0]
        if np.all(text == first):
            frames[where] = first.tobytes().decode("utf-8", "replace")
        else:
            frames[where] = [row.tobytes().decode("utf-8", "replace") for row in text]
    return frames


def bytes_at(batch: MessageBatch, starts: IntArray, length: int) -> NDArray[np.uint8]:
    """Return the `length` bytes from each start, (n, length)."""
    return np.lib.stride_tricks.sliding_window_view(batch.data, length)[starts]


def header_stamps(batch: MessageBatch, order: str) -> IntArray:
    """Return the stamps of messages that begin with a `std_msgs/Header` [ns]."""
    seconds = batch.at(batch.offsets + 4, f"{order}i4").astype(np.int64)
    nanoseconds = batch.at(batch.offsets + 8, f"{order}u4").astype(np.int64)
    stamps: IntArray = seconds * NANOSECONDS_PER_SECOND + nanoseconds
    return stamps


def aligned(position: IntArray) -> IntArray:
    """Return the next multiple of eight, where a double may start."""
    multiple: IntArray = (position + 7) & ~np.int64(7)
    return multiple
