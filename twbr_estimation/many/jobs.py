"""What is done with each recording, and how a worker does it.

A part of a recording is the unit of work; those of one recording come together, so that it is
read once.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ..errors import RecordingError, TwbrError
from ..workers import Channel
from .places import is_address, local_copy

WHOLE = ""
"""Name of the part that concerns the recording itself; it is the first of each job's parts."""


class Job(Protocol):
    """What is done with each recording; it is sent to the workers."""

    @property
    def verb(self) -> str:
        """Name of the job in the table."""
        ...

    @property
    def parts(self) -> tuple[str, ...]:
        """`WHOLE` and parts that do not depend on each other, such as the names of filters."""
        return (WHOLE,)

    def settings(self, part: str) -> str:
        """Return all that shapes a part's result beside the recording and the package."""
        ...

    def open(self, place: str, path: Path) -> Any:
        """Read the recording at `path`, which messages call `place`."""
        ...

    def run(self, opened: Any, part: str) -> Mapping[str, Any]:
        """Do one part; the result is plain data."""
        ...

    def is_there(self, result: Mapping[str, Any]) -> bool:
        """Return whether what a result in the table stands for is still there."""
        return True


@dataclass(frozen=True, slots=True)
class Share:
    """Some parts of one recording."""

    number: int
    """Of the recording in the series."""
    place: str
    content: str
    size: int
    parts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Batch:
    """What a worker does at a time."""

    shares: tuple[Share, ...]

    def __str__(self) -> str:
        """Return a name for the page of a cluster."""
        first, more = self.shares[0].place, len(self.shares) - 1
        return f"{first} and {more} more" if more else first


@dataclass(frozen=True, slots=True)
class Done:
    """What became of one part."""

    share: Share
    part: str
    result: Mapping[str, Any] | None
    error: str | None = None
    final: bool = True
    """Whether the same content gives the same again."""
    seconds: float = 0.0


class _Latest:
    """The recording that this process read last: its next parts need not read it again."""

    key: Any = None
    opened: Any = None


def do_batch(job: Job, batch: Batch, channel: Channel) -> list[Done]:
    """Do a batch, on whatever machine; a part that fails has its reason, and the rest goes on."""
    done: list[Done] = []
    for share in batch.shares:
        channel.require_wanted()
        begin = time.perf_counter()
        try:
            opened = _opened(job, share)
        except Exception as error:
            reading = time.perf_counter() - begin
            done.append(_failed(share, WHOLE, error, reading))
            continue
        reading = time.perf_counter() - begin
        for part in share.parts:
            channel.require_wanted()
            done.append(_part(job, share, opened, part, reading))
            reading = 0.0
    return done


def _opened(job: Job, share: Share) -> Any:
    key = job, share.place, share.content
    if _Latest.key != key:
        _Latest.key = _Latest.opened = None  # before the next is read: there is room for one
        with local_copy(share.place) as path:
            opened = job.open(share.place, path)
        _Latest.key, _Latest.opened = key, opened
    return _Latest.opened


def _part(job: Job, share: Share, opened: Any, part: str, before: float) -> Done:
    begin = time.perf_counter()
    try:
        result = job.run(opened, part)
    except Exception as error:
        return _failed(share, part, error, before + time.perf_counter() - begin)
    return Done(share, part, result, seconds=before + time.perf_counter() - begin)


def _failed(share: Share, part: str, error: Exception, seconds: float) -> Done:
    """Return a failure; that of a recording is final, that of a machine or its settings not."""
    final = isinstance(error, RecordingError) and not is_address(share.place)
    reason = str(error) if isinstance(error, TwbrError) else f"{type(error).__name__}: {error}"
    return Done(share, part, None, reason, final, seconds)
