"""Encoders counted by hardware, through the kernel's counter interface in sysfs."""

from __future__ import annotations

import errno
import os
from glob import glob
from pathlib import Path

from ..errors import SensorError
from .encoder import WIDEST

COUNTS = "/sys/bus/counter/devices/counter*/count*"
QUADRATURE = "quadrature x4"
CEILINGS = (2**32 - 1, 2**16 - 1)
"""Tried in this order where a count has the ceiling 0, which it can never leave."""
WIDTHS = {"ftm-quaddec": 2**16}
"""Modulus of counters without a ceiling, by the name of their driver."""
SMALLEST_MODULUS = 16
"""Of a count that wraps earlier, one read does not tell forward from backward."""


class SysfsCounter:
    """One count, such as `/sys/bus/counter/devices/counter0/count0`."""

    def __init__(self, directory: str, modulus: int = 0, use_index: bool = False) -> None:
        """Set the count up, enable it and open it.

        Args:
            directory: The count's folder in sysfs.
            modulus: Count at which it wraps; 0 reads it from the device.
            use_index: Let the device set the count to 0 at the index pulse.

        Raises:
            SensorError: no such count, not readable, or not counting in quadrature.
        """
        self._directory = Path(directory)
        self.errors = self.ambiguous = self.behind = 0
        self.zeroed_by_index = use_index
        self.remark = ""
        """Warning about this counter."""
        try:
            self._file = os.open(self._directory / "count", os.O_RDONLY)
        except OSError as error:
            raise SensorError(f"{directory}/count: {error.strerror}; {_available()}") from None
        try:
            self._set_up(use_index)
            self.modulus = modulus or self._asked_modulus()
            if self.modulus < SMALLEST_MODULUS:
                raise SensorError(
                    f"{directory}: the count wraps at {self.modulus}, too early to tell forward "
                    f"from backward; set `modulus`, or the ceiling, to {SMALLEST_MODULUS} or more"
                )
        except SensorError:
            self.close()
            raise

    def _set_up(self, use_index: bool) -> None:
        """Write what differs, while disabled: some counters refuse it otherwise."""
        wanted = {"function": QUADRATURE}
        if use_index:
            if not self._has("preset_enable"):
                raise SensorError(f"{self._directory}: this counter has no index (preset_enable)")
            wanted |= {"preset": "0", "preset_enable": "1"}
        changes = {name: value for name, value in wanted.items() if self._differs(name, value)}
        without_ceiling = self._has("ceiling") and self._value("ceiling") == "0"
        if changes or without_ceiling:
            self._set("enable", "0")
        self._set("function", QUADRATURE)
        if without_ceiling:
            self._raise_ceiling()
        for name, value in changes.items():
            self._set(name, value)
        self._set("enable", "1")

    def _raise_ceiling(self) -> None:
        for ceiling in CEILINGS:
            try:
                self._set("ceiling", str(ceiling))
            except SensorError as error:
                refusal = str(error)
            else:
                if self._value("ceiling") != "0":
                    return
                refusal = "it stays 0"
        raise SensorError(
            f"{self._directory}/ceiling: 0, so that the count can never leave 0, and it cannot "
            f"be raised: {refusal}"
        )

    def _asked_modulus(self) -> int:
        if self._has("ceiling"):
            try:
                return int(self._value("ceiling")) + 1
            except ValueError as error:
                raise SensorError(f"{self._directory}/ceiling: {error}") from None
        driver = self._driver()
        if driver in WIDTHS:
            return WIDTHS[driver]
        self.remark = (
            f"{self._directory}: {driver} does not say where its count wraps; set `modulus`, such "
            "as 65536 for 16 bits"
        )
        return WIDEST

    def _driver(self) -> str:
        """Return the driver's name; the attribute `name` is that of the device."""
        device = self._directory.resolve().parent
        link = device.parent / "driver"
        if link.exists():
            return link.resolve().name
        return _text(device / "name") if (device / "name").exists() else "this counter"

    def _has(self, name: str) -> bool:
        return (self._directory / name).exists()

    def _value(self, name: str) -> str:
        return _text(self._directory / name)

    def _differs(self, name: str, value: str) -> bool:
        return self._has(name) and self._value(name) != value

    def _set(self, name: str, value: str) -> None:
        """Write an attribute that the device has and whose value differs."""
        if not self._differs(name, value):
            return
        attribute = self._directory / name
        try:
            attribute.write_text(value)
        except OSError as error:
            raise SensorError(
                f"{attribute}: cannot be set to {value!r}: {error.strerror}; "
                f"{_advice(attribute, error)}"
            ) from None

    def read(self) -> int:
        """Return the count.

        Raises:
            OSError: it cannot be read, or is no number.
        """
        data = os.pread(self._file, 32, 0)
        try:
            return int(data)
        except ValueError:
            raise OSError(errno.EIO, f"{self._directory}/count: {data!r} is no count") from None

    def index(self) -> int | None:
        """Return None: the device acts on the index itself and keeps no mark of it."""
        return None

    def close(self) -> None:
        """Close the file; the hardware goes on counting."""
        os.close(self._file)


def _text(attribute: Path) -> str:
    try:
        return attribute.read_text(errors="replace").strip()
    except OSError as error:
        raise SensorError(f"{attribute}: {error.strerror}") from None


def _advice(attribute: Path, error: OSError) -> str:
    """Return what to do about an attribute that cannot be written."""
    if error.errno in (errno.EACCES, errno.EPERM):
        if attribute.stat().st_mode & 0o222:
            return "a udev rule can give the permission"
        return f"this counter does not let it be changed from {attribute.read_text().strip()!r}"
    if error.errno == errno.EBUSY:
        return "the counter is in use; disable it, or end what else has set it up"
    if error.errno in (errno.EINVAL, errno.ERANGE, errno.EOPNOTSUPP):
        return "this counter cannot do that"
    return "the counter's driver refuses it"


def _available() -> str:
    found = sorted(glob(COUNTS))
    return f"there are: {', '.join(found)}" if found else "this kernel has no counters"
