"""Recordings on disk (.mcap, .db3, ROS 1 .bag) to and from `Recording`."""

from __future__ import annotations

from .bag_files import recordings_below
from .reading import read_recording
from .topics import TopicNames
from .writing import BagTopic, require_room, write_recording

__all__ = [
    "BagTopic",
    "TopicNames",
    "read_recording",
    "recordings_below",
    "require_room",
    "write_recording",
]
