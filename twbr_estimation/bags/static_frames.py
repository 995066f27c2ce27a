"""Transforms that a recording holds on `/tf_static`."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..configuration.frames import Mounting, Transform, mounted, of_quaternion, urdf_frames
from ..errors import ConfigurationError, RecordingError
from ..robot import Robot
from .bag_files import bag_files
from .storage import parts

TF = "tf2_msgs/msg/TFMessage"
STATIC = ("/tf_static", "tf_static")
_HEAD = 4  # encapsulation, from which alignment counts
_MOST = 10_000  # transforms in one message


class FrameSource(NamedTuple):
    """Where the IMU's mounting comes from: a URDF, or what a recording holds."""

    names: Mounting
    urdf: Path | None = None
    """None takes the recording's `/tf_static`."""

    def robot(self, robot: Robot, bag: Path | None = None) -> Robot:
        """Return the robot with this mounting.

        Raises:
            ConfigurationError: a URDF or a frame that cannot be used.
            RecordingError: no transforms in the recording.
        """
        if self.urdf is not None:
            return mounted(robot, urdf_frames(self.urdf), self.names)
        return robot if bag is None else mounted(robot, read_static_frames(bag), self.names)


def read_static_frames(path: Path) -> tuple[Transform, ...]:
    """Return the transforms of `/tf_static`, in their order.

    Raises:
        RecordingError: no bag, or messages that cannot be read.
    """
    found: list[Transform] = []
    files, remarks = bag_files(path)
    for _, storage, allowance in parts(files, remarks):
        for topic, batch in storage.batches(frozenset(STATIC)):
            if storage.types[topic] != TF:
                raise RecordingError(f"{path}: {topic} is a {storage.types[topic]}, not a {TF}")
            plain, _ = batch.decompressed(allowance)
            for index in range(plain.offsets.size):
                found += decode_transforms(plain.message(index))
    if not found:
        raise RecordingError(f"{path}: there are no transforms on /tf_static")
    return tuple(found)


def decode_transforms(data: bytes) -> list[Transform]:
    """Return the transforms of a serialised `tf2_msgs/TFMessage`.

    Raises:
        RecordingError: the message cannot be read.
    """
    try:
        return list(_transforms(data))
    except (struct.error, UnicodeDecodeError, ConfigurationError) as error:
        raise RecordingError(f"a {TF} of {len(data)} bytes cannot be read: {error}") from None


def _transforms(data: bytes) -> Iterator[Transform]:
    (count,) = struct.unpack_from("<I", data, _HEAD)
    offset = _HEAD + 4
    for _ in range(min(count, _MOST)):
        offset = _aligned(offset, 4) + 8  # the stamp
        parent, offset = _text(data, offset)
        child, offset = _text(data, offset)
        offset = _aligned(offset, 8)
        x, y, z, *quaternion = struct.unpack_from("<7d", data, offset)
        offset += 56
        yield Transform(parent, child, of_quaternion(*quaternion), np.array([x, y, z]))


def _aligned(offset: int, size: int) -> int:
    return offset + (_HEAD - offset) % size


def _text(data: bytes, offset: int) -> tuple[str, int]:
    offset = _aligned(offset, 4)
    (length,) = struct.unpack_from("<I", data, offset)
    if length > len(data):
        raise struct.error(f"a name of {length} bytes")
    return data[offset + 4 : offset + 3 + length].decode(), offset + 4 + length
