"""Write a recording message by message, as they come."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path

from ..errors import RecordingError


class BagRecorder:
    """A rosbag2 directory that appears under its name once it is closed.

    Until then it grows in a folder beside it, `.NAME.partial`.
    """

    def __init__(self, target: Path, types: Mapping[str, str]) -> None:
        """Begin a recording.

        Args:
            target: Directory to create.
            types: Message types by topic, such as `sensor_msgs/msg/Imu`; they are those of
                ROS 2 Jazzy.

        Raises:
            RecordingError: something exists there, or the folder cannot be written.
        """
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self._target = target
        self._holder = target.parent / f".{target.name}.partial"
        self.folder = self._holder / target.name  # its files are named after it
        if target.exists() or self._holder.exists():
            raise RecordingError(f"{target}: exists; it is not overwritten")
        try:
            self._holder.mkdir(parents=True)
            self._writer = Writer(self.folder, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except OSError as error:
            raise self._unwritable(error) from None
        store = get_typestore(Stores.ROS2_JAZZY)
        self._connections = {
            topic: self._writer.add_connection(topic, kind, typestore=store)
            for topic, kind in types.items()
        }
        self._lock = threading.Lock()
        self._open = True
        self.messages = 0
        """Number of messages written."""
        self.failure: RecordingError | None = None
        """Why the recording ended early."""

    def add(self, topic: str, time: int, data: bytes) -> None:
        """Write one serialised message that was received at `time` [ns].

        What cannot be written ends the recording; `close` raises the reason.
        """
        with self._lock:
            if not self._open or self.failure is not None:
                return
            try:
                self._writer.write(self._connections[topic], time, data)
                self.messages += 1
            except OSError as error:
                self.failure = self._unwritable(error)

    def close(self) -> None:
        """Finish the recording and give it its name.

        Raises:
            RecordingError: it could not be written; what there is lies in `folder`.
        """
        with self._lock:
            if not self._open:
                return
            self._open = False
            try:
                self._writer.close()
                if self.failure is None:
                    self.folder.rename(self._target)
                    self._holder.rmdir()
            except OSError as error:
                self.failure = self.failure or self._unwritable(error)
            if self.failure is not None:
                raise self.failure

    def _unwritable(self, error: OSError) -> RecordingError:
        return RecordingError(f"{self._target}: cannot be written: {error.strerror or error}")
