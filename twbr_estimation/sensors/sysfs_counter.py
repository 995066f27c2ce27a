"""Encoders counted by hardware, through the kernel's counter interface in sysfs."""

from __future__ import annotations

import os
from glob import glob
from pathlib import Path

from ..errors import SensorError

COUNTS = "/sys/bus/counter/devices/counter*/count*"
QUADRATURE = "quadrature x4"
WIDEST = 2**64
"""Modulus of a count without a ceiling of its own."""


class SysfsCounter:
    """One count, such as `/sys/bus/counter/devices/counter0/count0`."""

    def __init__(self, directory: str, modulus: int = 0, use_index: bool = False) -> None:
        """Open and enable the count.

        Args:
            directory: The count's folder in sysfs.
            modulus: Where the count wraps; 0 asks the device.
            use_index: Let the device set the count to 0 at the index pulse.

        Raises:
            SensorError: no such count, not readable, or not counting in quadrature.
        """
        self._directory = Path(directory)
        self.errors = 0
        self.zeroed_by_index = use_index
        try:
            self._file = os.open(self._directory / "count", os.O_RDONLY)
        except OSError as error:
            raise SensorError(f"{directory}/count: {error.strerror}; {_available()}") from None
        try:
            self._set("function", QUADRATURE)
            self._set("enable", "1")
            if use_index:
                self._load_zero_at_index()
            self.modulus = modulus or self._ceiling()
        except SensorError:
            self.close()
            raise

    def _ceiling(self) -> int:
        try:
            return int((self._directory / "ceiling").read_text()) + 1
        except (OSError, ValueError):
            return WIDEST

    def _load_zero_at_index(self) -> None:
        if not (self._directory / "preset_enable").exists():
            raise SensorError(f"{self._directory}: this counter has no index (preset_enable)")
        self._set("preset", "0")
        self._set("preset_enable", "1")

    def _set(self, name: str, value: str) -> None:
        """Write an attribute that the device has and that says something else."""
        attribute = self._directory / name
        try:
            if attribute.exists() and attribute.read_text().strip() != value:
                attribute.write_text(value)
        except OSError as error:
            raise SensorError(
                f"{attribute}: cannot be set to {value!r}: {error.strerror}; a udev rule can give "
                "the permission"
            ) from None

    def read(self) -> int:
        """Return the count."""
        return int(os.pread(self._file, 32, 0))

    def index(self) -> int | None:
        """Return None: the device acts on the index itself and keeps no mark of it."""
        return None

    def close(self) -> None:
        """Close the file; the hardware goes on counting."""
        os.close(self._file)


def _available() -> str:
    found = sorted(glob(COUNTS))
    return f"there are: {', '.join(found)}" if found else "this kernel has no counters"
