"""Writing that fails at a chosen stage, or is killed there, in this process; needs a C compiler.

The process has to be started with `LD_PRELOAD`: see `library`.
"""

from __future__ import annotations

import ctypes
import subprocess
from enum import IntEnum
from pathlib import Path

from reliability.set_clock import compiler

SOURCE = Path(__file__).with_suffix(".c")


class Stage(IntEnum):
    """Steps of writing, in the numbers of the library."""

    OPEN = 0
    WRITE = 1
    FSYNC = 2
    RENAME = 3
    CLOSE = 4
    REMOVE = 5
    ANY = 6
    """Kills the process instead of failing."""


FAILING = (Stage.OPEN, Stage.WRITE, Stage.FSYNC, Stage.RENAME, Stage.CLOSE)
"""Those where a full disk shows."""


def library(folder: Path) -> Path | None:
    """Build the library in a folder; return its path, None where there is no C compiler.

    Raises:
        subprocess.CalledProcessError: it cannot be built.
    """
    found = compiler()
    if found is None:
        return None
    target = folder / "file_faults.so"
    command = [found, "-shared", "-fPIC", "-O1", "-o", str(target), str(SOURCE), "-ldl"]
    subprocess.run(command, check=True, capture_output=True)
    return target


def arm(folder: Path, stage: Stage | int, calls: int, error: int) -> None:
    """Let the `calls`-th call of a stage below a folder fail; 0 only counts.

    Args:
        folder: Absolute, without links.
        stage: `ANY` kills the process at the `calls`-th call of whatever stage.
        calls: From 1 on.
        error: Number of the error, as ENOSPC.
    """
    _functions().twbr_arm(str(folder).encode(), int(stage), ctypes.c_long(calls), error)


def counted() -> dict[Stage, int]:
    """Return how many calls of each stage there were since `arm`."""
    count = _functions().twbr_count
    count.restype = ctypes.c_long
    return {stage: count(int(stage)) for stage in Stage if stage is not Stage.ANY}


def _functions() -> ctypes.CDLL:
    return ctypes.CDLL(None)
