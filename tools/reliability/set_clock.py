"""A system clock that is set while a process runs, for that process alone; needs a C compiler."""

from __future__ import annotations

import mmap
import shutil
import struct
import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_suffix(".c")
COMPILERS = ("cc", "gcc", "clang")


def compiler() -> str | None:
    """Return a C compiler; None where there is none."""
    return next((found for name in COMPILERS if (found := shutil.which(name))), None)


class SetClock:
    """The clock of the processes that are started with `environment`."""

    def __init__(self, folder: Path) -> None:
        """Build the library in a folder.

        Raises:
            FileNotFoundError: there is no C compiler.
            subprocess.CalledProcessError: it cannot build the library.
        """
        found = compiler()
        if found is None:
            raise FileNotFoundError(f"none of {', '.join(COMPILERS)} is installed")
        library, offset = folder / "set_clock.so", folder / "offset"
        command = [found, "-shared", "-fPIC", "-O1", "-o", str(library), str(SOURCE)]
        subprocess.run([*command, "-ldl", "-pthread"], check=True, capture_output=True)
        offset.write_bytes(bytes(8))
        with offset.open("r+b") as file:
            self._offset = mmap.mmap(file.fileno(), 8)
        self.environment = {"LD_PRELOAD": str(library), "TWBR_CLOCK_OFFSET": str(offset)}
        """What a process has to be started with."""

    def set(self, seconds: float) -> None:
        """Let the clock be this far ahead of the computer's [s]; negative is behind it."""
        self._offset[:] = struct.pack("=q", round(seconds * 1e9))
