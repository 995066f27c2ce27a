"""Decode the wanted topics of all files of a bag."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import RecordingError
from .bag_files import bag_files
from .decoding import (
    Columns,
    decode_float64,
    decode_float64_array,
    decode_imu,
    decode_odometry,
    decode_temperature,
)
from .joint_states import decode_joint_state
from .message_batch import MessageBatch
from .storage import parts
from .topics import FLOAT64, FLOAT64_ARRAY, IMU, JOINT_STATE, ODOMETRY, TEMPERATURE
from .unpacking import Allowance


@dataclass(frozen=True, slots=True)
class TopicRequest:
    """One topic to decode, for one purpose."""

    topic: str
    types: tuple[str, ...]
    """Message types it may have."""
    joints: tuple[str, ...] = ()
    """Joints wanted of a JointState."""
    velocities: bool = False
    """Whether messages that give the joints' velocities alone count, too."""


@dataclass(slots=True)
class Contents:
    """The requested contents of a bag."""

    types: dict[str, str] = field(default_factory=dict)
    """Message type by topic, of all topics."""
    columns: dict[TopicRequest, Columns] = field(default_factory=dict)
    """Decoded messages; a request whose topic has no message is absent."""
    repairs: Counter[str] = field(default_factory=Counter)


def read_contents(path: Path, requests: Collection[TopicRequest]) -> Contents:
    """Decode what was asked for from every file of a bag.

    Raises:
        RecordingError: no bag, or a topic of another type than asked for.
    """
    contents = Contents()
    decoded: dict[TopicRequest, list[Columns]] = defaultdict(list)
    wanted = frozenset(request.topic for request in requests)
    files, remarks = bag_files(path)
    contents.repairs.update(remarks)
    for file, storage, allowance in parts(files, contents.repairs):
        for topic, batch in storage.batches(wanted):
            for request in requests:
                if request.topic == topic:
                    kind = storage.types[topic]
                    decoded[request].append(_decoded(path, request, kind, batch, allowance))
        contents.types.update(storage.types)
        for repair, number in storage.repairs.items():
            contents.repairs[f"{file.name}: {repair}"] += number
    contents.columns = {request: _concatenated(columns) for request, columns in decoded.items()}
    return contents


def _decoded(
    path: Path, request: TopicRequest, kind: str, batch: MessageBatch, allowance: Allowance
) -> Columns:
    if kind not in request.types:
        raise RecordingError(
            f"{path}: {request.topic} is a {kind}; needed is {' or '.join(request.types)}"
        )
    batch, damaged = batch.decompressed(allowance)
    try:
        if kind == JOINT_STATE:
            columns = decode_joint_state(batch, request.joints, request.velocities)
        else:
            columns = _DECODERS[kind](batch)
        columns.broken += damaged
        return columns
    except RecordingError as error:
        raise RecordingError(f"{path}: {request.topic}: {error}") from error


_DECODERS = {
    IMU: decode_imu,
    TEMPERATURE: decode_temperature,
    ODOMETRY: decode_odometry,
    FLOAT64: decode_float64,
    FLOAT64_ARRAY: decode_float64_array,
}


def _concatenated(parts: list[Columns]) -> Columns:
    return Columns(
        np.concatenate([part.stamps for part in parts]),
        np.concatenate([part.bag_times for part in parts]),
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.frames for part in parts]),
        sum(part.broken for part in parts),
        set().union(*(part.names for part in parts)),
    )
