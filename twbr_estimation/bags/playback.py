"""All messages of a bag as they were serialised, in the order in which they were recorded."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from .bag_files import bag_files
from .message_batch import IntArray, MessageBatch
from .storage import Storage, parts


@dataclass(frozen=True, slots=True)
class Playback:
    """A bag's messages in memory, oldest first."""

    types: dict[str, str]
    """Message type by topic, of the topics that are played."""
    times: IntArray
    """When each message was recorded [ns], (n,), increasing or equal."""
    repairs: Counter[str]
    """Number of messages that could not be read, by reason."""
    _topics: tuple[str, ...]
    _batches: tuple[MessageBatch, ...]
    _places: NDArray[np.int32]
    """Batch and index in it of each message, (n, 2)."""

    def __len__(self) -> int:
        return int(self.times.size)

    def time(self, index: int) -> int:
        """Return when a message was recorded [ns]."""
        return int(self.times[index])

    def message(self, index: int) -> tuple[str, bytes]:
        """Return topic and serialised content of one message."""
        batch, place = self._places[index]
        return self._topics[batch], self._batches[batch].message(int(place))

    def first_at(self, time: int) -> int:
        """Return the index of the first message recorded at `time` [ns] or later."""
        return int(np.searchsorted(self.times, time))


def read_playback(path: Path, without: frozenset[str] = frozenset()) -> Playback:
    """Read every message of a bag into memory.

    Args:
        path: a recording in any form that `read_recording` takes.
        without: topics to leave out.

    Raises:
        RecordingError: no bag, or no message in it.
    """
    types: dict[str, str] = {}
    repairs: Counter[str] = Counter()
    topics: list[str] = []
    batches: list[MessageBatch] = []
    files, remarks = bag_files(path)
    repairs.update(remarks)
    for _, storage, allowance in parts(files, repairs):
        for _ in storage.batches(frozenset()):  # makes the types known
            pass
        storage.repairs.clear()
        for topic, batch in storage.batches(_playable(storage, repairs) - without):
            plain, damaged = batch.decompressed(allowance)
            if damaged:
                repairs[f"{topic}: damaged messages dropped"] += damaged
            topics.append(topic)
            batches.append(plain)
            types[topic] = storage.types[topic]
        repairs.update(storage.repairs)
    if not batches:
        raise RecordingError(f"{path}: there is no message to play")
    times = np.concatenate([batch.bag_times for batch in batches])
    sizes = [batch.bag_times.size for batch in batches]
    owner = np.repeat(np.arange(len(batches), dtype=np.int32), sizes)
    place = np.concatenate([np.arange(size, dtype=np.int32) for size in sizes])
    order = np.argsort(times, kind="stable")
    places = np.column_stack([owner, place])[order]
    return Playback(types, times[order], repairs, tuple(topics), tuple(batches), places)


def _playable(storage: Storage, repairs: Counter[str]) -> frozenset[str]:
    """Return the topics whose messages ROS can be given as they are; the others are counted."""
    for topic, encoding in storage.encodings.items():
        if encoding != "cdr":
            repairs[f"{topic}: left out, as it is encoded as {encoding!r}, not 'cdr'"] += 1
    return frozenset(topic for topic in storage.types if storage.encodings[topic] == "cdr")
