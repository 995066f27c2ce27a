"""Write a recording message by message, as they come."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path

from ..errors import RecordingError


class BagRecorder:
    """A rosbag2 directory that appears under its name once it is closed.

    Until then it is written beside it, as `.NAME.partial`.
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
        self.folder = target.parent / f".{target.name}.partial"
        if target.exists() or self.folder.exists():
            raise RecordingError(f"{target}: exists; it is not overwritten")
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            self._writer = Writer(self.folder, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except OSError as error:
            raise RecordingError(f"{target}: cannot be written: {error.strerror}") from None
        store = get_typestore(Stores.ROS2_JAZZY)
        self._connections = {
            topic: self._writer.add_connection(topic, kind, typestore=store)
            for topic, kind in types.items()
        }
        self._lock = threading.Lock()
        self._open = True
        self.messages = 0
        """Number of messages written."""

    def add(self, topic: str, time: int, data: bytes) -> None:
        """Write one serialised message that was received at `time` [ns]."""
        with self._lock:
            if self._open:
                self._writer.write(self._connections[topic], time, data)
                self.messages += 1

    def close(self) -> None:
        """Finish the recording and give it its name."""
        with self._lock:
            if not self._open:
                return
            self._open = False
            self._writer.close()
            self.folder.rename(self._target)
