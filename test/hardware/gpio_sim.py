"""Lines of the kernel's simulated GPIO chip, set from here and read through /dev/gpiochip*."""

from __future__ import annotations

import os
import time
from itertools import count
from pathlib import Path

CONFIGFS = Path("/sys/kernel/config/gpio-sim")
TICK = 0.012
"""Longer than a tick of the slowest kernel, that of User-Mode Linux with 100 Hz [s]."""
_numbers = count()


class GpioSim:
    """One chip of `gpio-sim`; a line follows the pull that is set on it."""

    def __init__(self, lines: int = 16, label: str = "rig-gpio") -> None:
        """Create the chip.

        Raises:
            OSError: the kernel has none, or the user may not.
        """
        self.folder = CONFIGFS / f"twbr{os.getpid()}_{next(_numbers)}"
        bank = self.folder / "bank"
        bank.mkdir(parents=True)
        (bank / "num_lines").write_text(str(lines))
        (bank / "label").write_text(label)
        (self.folder / "live").write_text("1")
        name = (bank / "chip_name").read_text().strip()
        self.path = f"/dev/{name}"
        device = (self.folder / "dev_name").read_text().strip()
        self._lines = Path("/sys/devices/platform") / device / name
        self._levels = dict.fromkeys(range(lines), False)

    def set(self, line: int, high: bool) -> None:
        """Pull a line up or down."""
        self._levels[line] = high
        value = "pull-up" if high else "pull-down"
        (self._lines / f"sim_gpio{line}" / "pull").write_text(value)

    def turn(self, counts: int, line_a: int = 5, line_b: int = 6) -> None:
        """Turn an encoder on two lines by that many counts, no faster than edges are served.

        The chip raises an interrupt from a timer's tick: two changes within one are one edge.
        """
        for _ in range(abs(counts)):
            equal = self._levels[line_a] == self._levels[line_b]
            line = line_a if equal == (counts > 0) else line_b
            self.set(line, not self._levels[line])
            time.sleep(TICK)

    def close(self) -> None:
        """Remove the chip."""
        (self.folder / "live").write_text("0")
        (self.folder / "bank").rmdir()
        self.folder.rmdir()
