"""Errors of the system about a file, as errors of this package."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

from ..errors import WritingError

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def writing_error(path: Path, error: OSError, needed: int) -> WritingError:
    """Return an error that names what could not be written, why, and the space needed.

    Args:
        path: what was to be written.
        error: that of the system.
        needed: size of the content [bytes], 0 where unknown.
    """
    reason = (error.strerror or str(error)).lower()
    if error.errno not in _FULL:
        return WritingError(f"{path}: cannot be written: {reason}")
    folder = next((each for each in path.absolute().parents if each.exists()), Path("/"))
    need = f"up to {megabytes(needed)} needed, " if needed else ""
    limit = "the largest size of a file" if error.errno == errno.EFBIG else "free"
    free = "" if limit != "free" else f"{megabytes(_free(folder))} free in {folder}"
    return WritingError(f"{path}: cannot be written: {reason} ({need}{free or limit + ' reached'})")


def megabytes(size: float) -> str:
    """Return a size [bytes] for a reader: 1.5 MB, or 12 kB below a tenth of that."""
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def _free(folder: Path) -> int:
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return 0


def reason_of(error: OSError) -> str:
    """Return the system's message, without Python's numbers and quotes."""
    return os.strerror(error.errno).lower() if error.errno else str(error)
