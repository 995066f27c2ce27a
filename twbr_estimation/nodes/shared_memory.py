"""Shared memory that a killed process left half made; every later node would wait for it silently.

Fast DDS lets all processes of a computer meet in segments of `/dev/shm`, and waits without a limit
until the process that creates one has prepared it. One that is killed in between leaves no other.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from ..errors import ConfigurationError

FOLDER = Path("/dev/shm")
SEGMENTS = ("fastrtps_*", "fastdds_*")
LOCKS = ("_el", "_sl")
"""Ends of names of files that are empty by nature."""
UNPREPARED = (b"", b"\0\0\0\0", b"\1\0\0\0")
"""First four bytes of a segment that waits for its creator (Boost.Interprocess, little endian)."""
LONGEST_PREPARATION = 2.0
"""A creator needs microseconds; after this [s] it is not alive any more."""


def half_made(folder: Path = FOLDER) -> Iterator[Path]:
    """Yield the segments whose creator is gone."""
    latest = time.time() - LONGEST_PREPARATION
    for pattern in SEGMENTS:
        for path in folder.glob(pattern):
            if path.name.endswith(LOCKS):
                continue
            try:
                with path.open("rb") as file:
                    unprepared = file.read(4) in UNPREPARED
                if unprepared and path.stat().st_mtime < latest:
                    yield path
            except OSError:
                continue  # it has just gone, or belongs to another user


def remove_half_made(folder: Path = FOLDER) -> tuple[Path, ...]:
    """Remove the segments whose creator is gone; return which.

    Raises:
        ConfigurationError: one cannot be removed.
    """
    found = tuple(half_made(folder))
    for path in found:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"{path}: a killed process left it half made, every ROS node waits for it, and it "
                f"cannot be removed ({error.strerror}); delete it, or set "
                "FASTDDS_BUILTIN_TRANSPORTS=UDPv4"
            ) from None
    return found
