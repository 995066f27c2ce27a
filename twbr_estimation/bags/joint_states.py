"""Decode `sensor_msgs/JointState`, whose layout depends on its joint names."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .decoding import Columns, bytes_at, header_stamps, readable
from .message_batch import IntArray, MessageBatch

_SHARED_LAYOUTS = 32
"""Layouts looked for among all messages; after that each message is taken alone."""


@dataclass(frozen=True, slots=True)
class JointLayout:
    """Offsets of the numbers in one JointState; equal for messages of equal names."""

    frame: str
    names: tuple[str, ...]
    prefix: bytes
    """Bytes from the frame id to the first position."""
    positions: int
    """Offset of the first position in the message."""
    velocities: int
    """Offset of the first velocity."""
    position_count: int
    velocity_count: int


def decode_joint_state(
    batch: MessageBatch, joints: tuple[str, ...], velocities: bool = False
) -> Columns:
    """Return positions, then velocities, of these joints; NaN where a message lacks one.

    With `velocities`, messages that give a velocity but no position of a joint count as well.

    Messages with none of the joints are left out: other publishers may share the topic.
    Messages that are too short are counted as broken.
    """
    whole, order = readable(batch, 16)
    size = whole.offsets.size
    empty = np.full((size, 2 * len(joints)), np.nan)
    columns = _Filling(whole, order, joints, empty, velocities)
    columns.broken = batch.offsets.size - size
    pending = np.ones(size, dtype=bool)
    while pending.any():
        columns.take_layout_of(int(np.argmax(pending)), pending)
    chosen = whole.take(columns.found)
    return Columns(
        header_stamps(chosen, order),
        chosen.bag_times,
        columns.values[columns.found],
        columns.frames[columns.found],
        columns.broken,
        columns.names,
    )


class _Filling:
    """Columns of one batch while its layouts are discovered."""

    def __init__(
        self,
        batch: MessageBatch,
        order: str,
        joints: tuple[str, ...],
        values: NDArray[np.float64],
        velocities: bool,
    ) -> None:
        self.batch, self.order, self.joints, self.values = batch, order, joints, values
        self.velocities = velocities
        self.found = np.zeros(len(values), dtype=bool)
        self.frames = np.full(len(values), "", dtype=object)
        self.names: set[str] = set()
        self.broken = 0
        self._layouts = 0

    def take_layout_of(self, index: int, pending: NDArray[np.bool_]) -> None:
        """Decode every pending message that is laid out as this one."""
        layout = joint_layout(self.batch.message(index), self.order)
        self._layouts += 1
        if layout is None:
            pending[index] = False
            self.broken += 1
            return
        same = self._same(index, layout, pending)
        pending[same] = False
        self.names.update(layout.names)
        self.frames[same] = layout.frame
        self._fill(same, layout)

    def _same(self, index: int, layout: JointLayout, pending: NDArray[np.bool_]) -> IntArray:
        if self._layouts > _SHARED_LAYOUTS:
            return np.array([index])
        batch = self.batch
        equal = np.flatnonzero(pending & (batch.sizes == batch.sizes[index]))
        starts = batch.offsets[equal]
        prefix = bytes_at(batch, starts + 12, len(layout.prefix))
        counts = batch.at(starts + _velocity_count_at(layout), f"{self.order}u4")
        like = np.all(prefix == np.frombuffer(layout.prefix, np.uint8), axis=1)
        same: IntArray = equal[like & (counts == layout.velocity_count)]
        return same

    def _fill(self, same: IntArray, layout: JointLayout) -> None:
        starts = self.batch.offsets[same]
        double = f"{self.order}f8"
        for column, joint in enumerate(self.joints):
            if joint not in layout.names:
                continue
            place = layout.names.index(joint)
            if place < layout.position_count:
                self.found[same] = True
                position = self.batch.at(starts + layout.positions + 8 * place, double)
                self.values[same, column] = position
            if place < layout.velocity_count:
                self.found[same] |= self.velocities
                velocity = self.batch.at(starts + layout.velocities + 8 * place, double)
                self.values[same, column + len(self.joints)] = velocity


def _velocity_count_at(layout: JointLayout) -> int:
    return layout.positions + 8 * layout.position_count


def joint_layout(message: bytes, order: str) -> JointLayout | None:
    """Return where the numbers of one serialised JointState lie; None if it is too short."""
    try:
        frame, at = _string(message, 12, order)
        count, at = _count(message, at, order)
        names = []
        for _ in range(count):
            name, at = _string(message, at, order)
            names.append(name)
        position_count, positions = _doubles(message, at, order)
        velocity_count, velocities = _doubles(message, positions + 8 * position_count, order)
        _doubles(message, velocities + 8 * velocity_count, order)
    except (struct.error, UnicodeDecodeError, OverflowError):
        return None
    prefix = message[12:positions]
    return JointLayout(
        frame, tuple(names), prefix, positions, velocities, position_count, velocity_count
    )


def _count(message: bytes, at: int, order: str) -> tuple[int, int]:
    at += -at % 4
    return struct.unpack_from(f"{order}I", message, at)[0], at + 4


def _string(message: bytes, at: int, order: str) -> tuple[str, int]:
    length, at = _count(message, at, order)
    if at + length > len(message):
        raise struct.error(f"a string of {length} bytes does not fit")
    return message[at : at + max(length - 1, 0)].decode(), at + length


def _doubles(message: bytes, at: int, order: str) -> tuple[int, int]:
    """Return the length of a sequence of doubles and the offset of its first one."""
    count, at = _count(message, at, order)
    if count:
        at += (4 - at) % 8
    if at + 8 * count > len(message):
        raise struct.error(f"{count} doubles do not fit")
    return count, at
