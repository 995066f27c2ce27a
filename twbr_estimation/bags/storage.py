"""Interface of every kind of bag file, and the signatures that distinguish them."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol

from ..disk.reading import open_regular
from ..errors import RecordingError
from .mcap_records import MAGIC as MCAP_MAGIC
from .message_batch import MessageBatch
from .packed_files import is_packed, unpack
from .unpacking import Allowance

_HEAD = 16
"""First bytes of a file, which identify its kind."""


class Storage(Protocol):
    """One file of recorded messages."""

    types: dict[str, str]
    """Message type by topic; complete after `batches` has been read to its end."""
    encodings: dict[str, str]
    """Serialisation of messages, by topic; complete when `types` is."""
    repairs: Counter[str]
    """Number of messages that could not be read, by reason."""

    def batches(self, wanted: frozenset[str]) -> Iterator[tuple[str, MessageBatch]]:
        """Yield topic and messages of the wanted topics.

        Raises:
            RecordingError: the file is not what its first bytes promise.
        """
        ...


def _mcap() -> type[Any]:
    from .mcap_storage import McapStorage

    return McapStorage


def _sqlite() -> type[Any]:
    from .sqlite_storage import SqliteStorage

    return SqliteStorage


def _ros1() -> type[Any]:
    from .ros1_storage import Ros1Storage

    return Ros1Storage


_KINDS: dict[bytes, Callable[[], type[Any]]] = {
    MCAP_MAGIC: _mcap,
    b"SQLite format 3\x00": _sqlite,
    b"#ROSBAG V2.0": _ros1,
}
"""Signatures, and the classes for them; only that of the file at hand is imported."""


def parts(
    files: Sequence[Path], repairs: Counter[str]
) -> Iterator[tuple[Path, Storage, Allowance]]:
    """Open the files of a recording one after the other; parts that are no bags are counted.

    Yields:
        The file, its messages, and how much of it may still be unpacked.

    Raises:
        RecordingError: none of them is a bag; the reason is that of the first.
    """
    first, count = None, 0
    for file in files:
        with ExitStack() as stack:
            try:
                storage, allowance = stack.enter_context(opened(file))
            except RecordingError as error:
                first = first or error
                why = str(error).removeprefix(f"{file}: ")
                repairs[f"{file.name}: this part is left out: {why}"] += 1
                continue
            count += 1
            yield file, storage, allowance
    if first is not None and not count:
        raise first


@contextmanager
def opened(path: Path) -> Iterator[tuple[Storage, Allowance]]:
    """Open one bag file by its first bytes; one compressed as a whole is unpacked for a while.

    Yields:
        The file's messages, and how much of it may still be unpacked.

    Raises:
        RecordingError: missing, empty, no bag, or one that unpacks to far more than its size.
    """
    with open_regular(path, RecordingError) as file:
        head = file.read(_HEAD)
    allowance = Allowance(str(path), path.stat().st_size)
    if not is_packed(head):
        yield _storage(path, path, head, allowance), allowance
        return
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / path.stem
        unpack(path, head, plain, allowance)
        with plain.open("rb") as file:
            head = file.read(_HEAD)
        yield _storage(path, plain, head, allowance), allowance


def _storage(name: Path, path: Path, head: bytes, allowance: Allowance) -> Storage:
    if not head:
        raise RecordingError(f"{name}: the file is empty")
    for magic, kind in _KINDS.items():
        if head.startswith(magic):
            storage: Storage = kind()(path, allowance)
            return storage
    raise RecordingError(f"{name}: not a recording; an .mcap, .db3 or ROS 1 .bag file is needed")
