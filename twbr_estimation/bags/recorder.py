"""Write a recording message by message, as they come.

A recording has its name once it is whole. What a recorder that was killed, or whose disk was
full, had written by then is kept beside it as `NAME_cut_off`, which can be read like any other;
messages that were still in memory, up to a megabyte of them, are lost.
"""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from ..disk.exchange import put_in_place
from ..disk.faults import writing_error
from ..disk.locks import directory_locked, locked
from ..disk.partials import PARTIAL, abandoned, discard, synchronised, token
from ..errors import RecordingError

CUT_OFF = "_cut_off"
"""Ending of the name of a recording that ended too early."""
_BEGUN = ".recording"
"""Ending of the name, between that of the recording and the token, of its temporary folder."""
_LATEST = (1 << 63) - 1
_EMPTY = 1024
"""A file up to this size has a head and no messages [bytes]."""


class BagRecorder:
    """A rosbag2 directory that appears under its name once it is closed."""

    def __init__(self, target: Path, types: Mapping[str, str]) -> None:
        """Begin a recording; keep what killed recorders left in the folder.

        Args:
            target: Directory to create.
            types: Message types by topic, such as `sensor_msgs/msg/Imu`; they are those of
                ROS 2 Jazzy.

        Raises:
            RecordingError: something exists there, the folder cannot be written, or a type is not
                known.
        """
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self._target = target
        self._holder = target.parent / f".{target.name}{_BEGUN}.{token()}{PARTIAL}"
        self._held: int | None = None
        self.folder = self._holder / target.name  # its files are named after it
        if target.exists():
            raise RecordingError(f"{target}: exists; it is not overwritten")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            self.recovered = recover(target.parent)
            """Recordings that killed recorders had begun in the same folder."""
            self._hold()
            self._writer = Writer(self.folder, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except OSError as error:
            self._release()
            raise self._unwritable(error) from None
        store = get_typestore(Stores.ROS2_JAZZY)
        self._connections = {}
        for topic, kind in types.items():
            if not isinstance(kind, str) or kind not in store.types:
                self._abort()
                self._release()
                raise RecordingError(
                    f"{target}: {topic}: {kind!r} is no message type of ROS 2 Jazzy, as "
                    "'sensor_msgs/msg/Imu' is"
                )
            self._connections[topic] = self._writer.add_connection(topic, kind, typestore=store)
        self._lock = threading.Lock()
        self._open = True
        self.messages = 0
        """Number of messages written."""
        self.failure: RecordingError | None = None
        """Why the recording ended early."""

    def add(self, topic: str, time: int, data: bytes) -> None:
        """Write one serialised message that was received at `time` [ns], from 1970 on.

        What cannot be written ends the recording; `close` raises the reason.
        """
        with self._lock:
            if not self._open or self.failure is not None:
                return
            try:
                self._writer.write(self._connections[topic], min(max(time, 0), _LATEST), data)
                self.messages += 1
            except OSError as error:
                self.failure = self._unwritable(error)

    def close(self) -> None:
        """Finish the recording and give it its name.

        Raises:
            RecordingError: it could not be written; the message names what there is.
        """
        with self._lock:
            if not self._open:
                return
            self._open = False
            try:
                self._finish()
            except OSError as error:
                self.failure = self.failure or self._unwritable(error)
            if self.failure is None:
                self._release()
                return
            self._abort()
            raise self._with_rest(self.failure)

    def _hold(self) -> None:
        with directory_locked(self._target.parent):
            self._holder.mkdir()
            self._held = locked(self._holder)

    def _finish(self) -> None:
        if self.failure is not None:
            return
        self._writer.close()
        synchronised(self._holder, everything=True)
        with directory_locked(self._target.parent):
            if os.path.lexists(self._target):
                raise FileExistsError(errno.EEXIST, "exists already", str(self._target))
            put_in_place(self.folder, self._target)
        synchronised(self._target.parent)

    def _abort(self) -> None:
        with suppress(OSError):
            if self._writer.storage is not None:
                self._writer.storage.abort()

    def _with_rest(self, failure: RecordingError) -> RecordingError:
        """Keep what was written; return the failure with its name."""
        try:
            kept = kept_apart(self._holder)
        except OSError:
            self._unlock()
            return RecordingError(f"{failure}; {self._holder} has the beginning")
        self._release()
        return failure if kept is None else RecordingError(f"{failure}; {kept} has the beginning")

    def _release(self) -> None:
        discard(self._holder)
        self._unlock()

    def _unlock(self) -> None:
        if self._held is not None:
            os.close(self._held)
            self._held = None

    def _unwritable(self, error: OSError) -> RecordingError:
        return RecordingError(str(writing_error(self._target, error, 0)))


def recover(folder: Path) -> list[Path]:
    """Keep what killed recorders left in a folder under a visible name; return the paths.

    Raises:
        OSError: the folder cannot be read or written.
    """
    found = []
    with directory_locked(folder):
        for holder, lock in abandoned(folder, _BEGUN):
            try:
                kept = kept_apart(holder)
            finally:
                os.close(lock)
            found += [] if kept is None else [kept]
            discard(holder)
    return found


def kept_apart(holder: Path) -> Path | None:
    """Move the recording in a temporary folder beside it; None where it holds no messages.

    Raises:
        OSError: it cannot be moved.
    """
    bags = [bag for bag in holder.glob("*/*.mcap") if bag.stat().st_size > _EMPTY]
    if not bags:
        return None
    name = f"{bags[0].parent.name}{CUT_OFF}"
    names = (name, *(f"{name}_{number}" for number in range(2, 1000)))
    free = next(each for each in names if not os.path.lexists(holder.with_name(each)))
    os.rename(bags[0].parent, holder.with_name(free))
    return holder.with_name(free)
