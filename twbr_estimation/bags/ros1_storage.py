"""Read ROS 1 bags through rosbags, which turns their messages into those of ROS 2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import RecordingError
from .message_batch import MessageBatch, joined
from .ros1_limits import require_bounded
from .topics import absolute
from .unpacking import Allowance

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader
    from rosbags.typesys.store import Typestore

_ROWS = 16384
"""Messages decoded at once."""


class Ros1Storage:
    """One .bag file; see `Storage`."""

    def __init__(self, path: Path, allowance: Allowance) -> None:
        self.path, self._allowance = path, allowance
        self.types: dict[str, str] = {}
        self.encodings: dict[str, str] = {}
        self.repairs: Counter[str] = Counter()

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield the wanted topics' messages in the order of time."""
        # Imported here: few recordings are ROS 1 bags, and the others are read sooner without.
        from rosbags.rosbag1 import Reader
        from rosbags.typesys import Stores, get_typestore

        require_bounded(self.path, self._allowance)
        typestore = get_typestore(Stores.ROS2_JAZZY)
        try:
            with Reader(self.path) as bag:
                self.types = {absolute(entry.topic): entry.msgtype for entry in bag.connections}
                self.encodings = dict.fromkeys(self.types, "cdr")
                for topic in sorted(wanted & self.types.keys()):
                    kind = self.types[topic]
                    if kind not in typestore.types:
                        continue
                    entries = [each for each in bag.connections if absolute(each.topic) == topic]
                    for batch in _batches(self._messages(bag, entries, typestore, topic)):
                        yield topic, batch
        except RecordingError:
            raise
        except Exception as error:  # a damaged bag makes the reader fail in any way
            raise RecordingError(f"{self.path}: {_reason(error)}") from error

    def _messages(
        self, bag: Reader, entries: list[Connection], typestore: Typestore, topic: str
    ) -> Iterator[tuple[int, bytes]]:
        """Yield time and content of one topic's messages; damaged ones are counted."""
        for _, time, raw in bag.messages(connections=entries):
            try:
                content = bytes(typestore.ros1_to_cdr(raw, self.types[topic]))
            except Exception:  # neither are the failures of a conversion documented
                self.repairs[f"{topic}: damaged messages dropped"] += 1
                continue
            yield time, content


def _reason(error: Exception) -> str:
    """Return why a bag cannot be read, the most frequent cause in words of our own."""
    text = str(error)
    if "index" in text.lower():
        return "it was cut off or not closed: its index is missing; `rosbag reindex` may mend it"
    return f"{text or type(error).__name__} (`rosbag reindex` may mend a bag that was not closed)"


def _batches(messages: Iterator[tuple[int, bytes]]) -> Iterator[MessageBatch]:
    times: list[int] = []
    contents: list[bytes] = []
    for time, content in messages:
        times.append(time)
        contents.append(content)
        if len(times) == _ROWS:
            yield joined(contents, np.array(times, dtype=np.int64))
            times, contents = [], []
    if times:
        yield joined(contents, np.array(times, dtype=np.int64))
