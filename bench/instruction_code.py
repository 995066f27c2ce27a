"""Machine code for `bench/instructions.py`, made for a processor that valgrind also has.

Valgrind shows another processor than the computer has, so code made for that one would not be
loaded. This code is made for any x86-64 and lies in a folder of its own.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

import twbr_estimation.live_code.files as files

FOLDER = "TWBR_BENCH_CODE"
"""Variable that names the folder."""
STEPS = ("correction", "ins_odometer")


def environment(folder: Path) -> dict[str, str]:
    """Return the variables of a process that makes or loads the code."""
    return {FOLDER: str(folder), "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}


def use_folder(variables: Mapping[str, str] = os.environ) -> None:
    """Look for machine code in the bench's folder only, if there is one."""
    if folder := variables.get(FOLDER):
        files.folders = lambda: (Path(folder),)


def prepare() -> None:
    """Compile the steps, keep them, and check them against the interpreted ones."""
    from twbr_estimation.live_code.checking import check
    from twbr_estimation.live_code.loading import processor
    from twbr_estimation.live_code.precompile import compiled

    use_folder()
    for name in STEPS:
        files.saved(name, files.made_for(processor()), compiled(name))
        check(name)


if __name__ == "__main__":
    sys.exit(prepare())
