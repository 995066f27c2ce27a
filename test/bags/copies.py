"""Copies of recordings that other packages write."""

from __future__ import annotations

from pathlib import Path

from rosbags import rosbag2
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin


def copy_with_rosbags(
    source: Path,
    target: Path,
    plugin: StoragePlugin,
    mode: CompressionMode = CompressionMode.NONE,
    version: int = 9,
) -> None:
    """Write the messages of a recording with rosbags."""
    writer = rosbag2.Writer(target, version=version, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with rosbag2.Reader(source) as bag, writer:
        connections = {
            entry.id: writer.add_connection(
                entry.topic, entry.msgtype, msgdef=entry.msgdef.data, rihs01=entry.digest
            )
            for entry in bag.connections
        }
        for entry, stamp, raw in bag.messages():
            writer.write(connections[entry.id], stamp, raw)
