"""Answers the transfers of the kernel rig's I2C adapter; its format is described in rig_i2c.c."""

from __future__ import annotations

import os
import select
import struct
import threading
from glob import glob
from pathlib import Path

from hardware.transfers import READS, Adapter, Message

DEVICE = Path("/dev/rig_i2c")
_HEAD = struct.Struct("=4H")


def bus_number() -> int:
    """Return N of the /dev/i2c-N of the rig's adapter."""
    for name in glob("/sys/bus/i2c/devices/i2c-*/name"):
        if Path(name).read_text().strip() == "rig":
            return int(Path(name).parent.name.removeprefix("i2c-"))
    raise LookupError("the rig's adapter is not among /sys/bus/i2c/devices")


class Relay:
    """Serves an adapter from a thread until it is closed."""

    def __init__(self, adapter: Adapter) -> None:
        self.adapter = adapter
        self._file = os.open(DEVICE, os.O_RDWR | os.O_NONBLOCK)
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            ready, _, _ = select.select([self._file, self._stop], [], [])
            if self._stop in ready:
                return
            try:
                result, data = self.adapter.transfer(_messages(os.read(self._file, 65536)))
                os.write(self._file, struct.pack("=i", result) + data)
            except OSError:  # given up meanwhile
                continue

    def close(self) -> None:
        """End the thread."""
        os.write(self._stopper, b"x")
        self._thread.join()
        for each in (self._file, self._stop, self._stopper):
            os.close(each)


def _messages(data: bytes) -> list[Message]:
    (count,) = struct.unpack_from("=I", data)
    offset = 4 + count * _HEAD.size
    found = []
    for index in range(count):
        address, flags, length, _ = _HEAD.unpack_from(data, 4 + index * _HEAD.size)
        message = Message(address, flags, length)
        if not flags & READS:
            message.data, offset = data[offset : offset + length], offset + length
        found.append(message)
    return found
