"""Write files and folders whole or not at all.

The content is written under a temporary name beside its target and flushed to the disk; then it
replaces the target in one step. A process that is killed, a full disk or an exception
leaves the old content or the new, never a part of it. What a killed process left behind is
removed by the next writer of the same target; a lock that dies with its process distinguishes it
from the work of a writer that still runs.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from ..errors import WritingError
from .exchange import put_in_place
from .faults import writing_error
from .locks import directory_locked, locked, own
from .partials import PARTIAL, clean_up, discard, synchronised, token

_MODE = 0o666  # less what the user's umask withholds


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all.

    A character that UTF-8 lacks (of a file name that is no text) is written as an escape.

    Raises:
        WritingError: it cannot be written; the old content is still there.
    """
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all; errors as `write_text`."""
    with whole_file(path, needed=len(content)) as temporary:
        temporary.write_bytes(content)


def write_texts(contents: Mapping[Path, str]) -> None:
    """Write several text files: all are on the disk before the first replaces its target.

    Raises:
        WritingError: one cannot be written; where it is known before the first takes its place,
            as of a full disk, all old contents are still there.
    """
    with ExitStack() as stack:
        for path, text in contents.items():
            encoded = text.encode("utf-8", "backslashreplace")
            temporary = stack.enter_context(whole_file(path, needed=len(encoded)))
            temporary.write_bytes(encoded)
            synchronised(temporary)


@contextmanager
def whole_file(path: Path, needed: int = 0, replace: bool = True) -> Iterator[Path]:
    """Yield a temporary file to write, which replaces `path` at the end.

    A device or pipe (`/dev/stdout`) is given itself: there is nothing to replace. Missing
    folders are made.

    Args:
        path: file to write or to replace; a link keeps pointing to it.
        needed: size of the content [bytes] for the message of a full disk; 0 where unknown.
        replace: whether a file that appears there meanwhile may be replaced.

    Raises:
        WritingError: it cannot be written; the old content is still there.
    """
    try:
        if _is_special(path):
            yield path
            return
        with _replaced_file(path.resolve(), replace) as temporary:
            yield temporary
    except OSError as error:
        raise writing_error(path, error, needed) from None


@contextmanager
def whole_folder(path: Path, needed: int = 0, replace: bool = True) -> Iterator[Path]:
    """Yield the path of a folder to make, which replaces `path` at the end.

    Args:
        path: folder to make or to replace; its name is that of the given path.
        needed: size of the content [bytes] for the message of a full disk; 0 where unknown.
        replace: whether a folder that appears there meanwhile may be replaced.

    Raises:
        WritingError: it cannot be written; the old folder is still there.
    """
    temporary = path
    try:
        with _replaced_folder(path.resolve(), replace) as temporary:
            yield temporary
    except OSError as error:
        raise writing_error(path, error, needed) from None
    except WritingError as error:  # of a file inside
        raise WritingError(str(error).replace(str(temporary), str(path))) from None


def _is_special(path: Path) -> bool:
    """Return whether something is there that is neither a file nor a folder."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return False
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "is a directory", str(path))
    return not stat.S_ISREG(mode)


@contextmanager
def _replaced_file(target: Path, replace: bool) -> Iterator[Path]:
    with _parents_made(target.parent):
        with directory_locked(target.parent):
            clean_up(target)
            temporary = target.with_name(f".{target.name}.{token()}{PARTIAL}")
            descriptor = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, _MODE)
            own(descriptor)
        try:
            yield temporary
            _keep_rights(target, temporary)
            synchronised(temporary)
            with directory_locked(target.parent):
                _require_room(target, replace)
                os.replace(temporary, target)
            synchronised(target.parent)
        finally:
            temporary.unlink(missing_ok=True)
            os.close(descriptor)


@contextmanager
def _replaced_folder(target: Path, replace: bool) -> Iterator[Path]:
    with _parents_made(target.parent):
        with directory_locked(target.parent):
            clean_up(target)
            holder = target.with_name(f".{target.name}.{token()}{PARTIAL}")
            holder.mkdir()
            lock = locked(holder)
        try:
            yield holder / target.name
            synchronised(holder, everything=True)
            with directory_locked(target.parent):
                _require_room(target, replace)
                put_in_place(holder / target.name, target)
            synchronised(target.parent)
        finally:
            discard(holder)
            if lock is not None:
                os.close(lock)


@contextmanager
def _parents_made(folder: Path) -> Iterator[None]:
    """Make a folder with its parents; those made are removed again where the work fails."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for each in missing:
            with suppress(OSError):
                each.rmdir()
        raise


def _require_room(target: Path, replace: bool) -> None:
    if not replace and os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, "exists already", str(target))


def _keep_rights(target: Path, temporary: Path) -> None:
    """Give the new file the mode and, where allowed, the owner of the one it replaces."""
    try:
        old = target.stat()
    except FileNotFoundError:
        return
    new = temporary.stat()
    if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
        with suppress(OSError):
            os.chown(temporary, old.st_uid, old.st_gid)
    temporary.chmod(stat.S_IMODE(old.st_mode))
