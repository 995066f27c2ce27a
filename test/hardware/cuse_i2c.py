"""An `/dev/i2c-N` served by this process through CUSE, the kernel's devices in user space.

The protocol is that of <linux/fuse.h>: a request has a header of 40 bytes, an answer one of 16. An
ioctl of an unrestricted device is asked several times, until the server has named all memory of
the caller that it needs.
"""

from __future__ import annotations

import ctypes
import errno
import os
import select
import struct
import threading
from pathlib import Path

from hardware.transfers import READS, Adapter, Message

DEVICE = Path("/dev/cuse")
CUSE_INIT, OPEN, RELEASE, FLUSH, INTERRUPT, IOCTL = 4096, 14, 18, 25, 36, 39
UNRESTRICTED_IOCTL = 1
RETRY = 1 << 2
LARGEST = 1 << 17
I2C_SLAVE, I2C_FUNCS, I2C_RDWR = 0x0703, 0x0705, 0x0707
FUNC_I2C = 1

_REQUEST = struct.Struct("=IIQQIIIHH")
_ANSWER = struct.Struct("=IiQ")
_IOCTL_IN = struct.Struct("=QIIQII")
_IOCTL_OUT = struct.Struct("=iIII")
_RDWR = struct.Struct("=QI4x")
_MESSAGE = struct.Struct("=HHH2xQ")
Pieces = list[tuple[int, int]]
"""Address and length of pieces of the caller's memory."""


class CuseI2c:
    """Serves an adapter as `/dev/i2c-NUMBER` from a thread until it is closed."""

    def __init__(self, adapter: Adapter, number: int) -> None:
        self.adapter, self.number = adapter, number
        self._file = os.open(DEVICE, os.O_RDWR)
        self._stop, self._stopper = os.pipe()
        self._initialise()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _initialise(self) -> None:
        request = os.read(self._file, LARGEST)
        _, operation, unique, *_ = _REQUEST.unpack_from(request)
        assert operation == CUSE_INIT
        major, minor = struct.unpack_from("=II", request, _REQUEST.size)
        body = struct.pack(
            "=8I40x", major, minor, 0, UNRESTRICTED_IOCTL, LARGEST // 2, LARGEST // 2, 0, 0
        )
        self._answer(unique, 0, body + f"DEVNAME=i2c-{self.number}\0".encode())

    def _answer(self, unique: int, error: int, body: bytes = b"") -> None:
        os.write(self._file, _ANSWER.pack(_ANSWER.size + len(body), -error, unique) + body)

    def _serve(self) -> None:
        while True:
            ready, _, _ = select.select([self._file, self._stop], [], [])
            if self._stop in ready:
                return
            request = os.read(self._file, LARGEST)
            _, operation, unique, *_ = _REQUEST.unpack_from(request)
            body = request[_REQUEST.size :]
            if operation == OPEN:
                self._answer(unique, 0, bytes(16))
            elif operation == IOCTL:
                self._ioctl(unique, body)
            elif operation in (RELEASE, FLUSH):
                self._answer(unique, 0)
            elif operation != INTERRUPT:
                self._answer(unique, errno.ENOSYS)

    def _ioctl(self, unique: int, body: bytes) -> None:
        _, _, command, argument, _, room = _IOCTL_IN.unpack_from(body)
        given = body[_IOCTL_IN.size :]
        if command == I2C_SLAVE:
            self._done(unique, 0)
        elif command == I2C_FUNCS:
            size = ctypes.sizeof(ctypes.c_ulong)
            if room < size:
                self._again(unique, [], [(argument, size)])
            else:
                self._done(unique, 0, FUNC_I2C.to_bytes(size, "little"))
        elif command == I2C_RDWR:
            self._transfer(unique, argument, given)
        else:
            self._answer(unique, errno.ENOTTY)

    def _transfer(self, unique: int, argument: int, given: bytes) -> None:
        """Ask for the list, for its messages, for their bytes; then transfer."""
        whole: Pieces = [(argument, _RDWR.size)]
        if len(given) < _RDWR.size:
            self._again(unique, whole, [])
            return
        address, count = _RDWR.unpack_from(given)
        whole.append((address, count * _MESSAGE.size))
        heads = _RDWR.size + count * _MESSAGE.size
        if len(given) < heads:
            self._again(unique, whole, [])
            return
        raw = [_MESSAGE.unpack_from(given, _RDWR.size + i * _MESSAGE.size) for i in range(count)]
        written = [(at, length) for _, flags, length, at in raw if not flags & READS]
        read = [(at, length) for _, flags, length, at in raw if flags & READS]
        if len(given) < heads + sum(length for _, length in written):
            self._again(unique, whole + written, read)
            return
        messages = [Message(target, flags, length) for target, flags, length, _ in raw]
        for message in messages:
            if not message.flags & READS:
                message.data, heads = given[heads : heads + message.length], heads + message.length
        result, data = self.adapter.transfer(messages)
        if result < 0:
            self._answer(unique, -result)
        else:
            self._done(unique, result, data)

    def _again(self, unique: int, give: Pieces, take: Pieces) -> None:
        pieces = b"".join(struct.pack("=QQ", *piece) for piece in (*give, *take))
        self._answer(unique, 0, _IOCTL_OUT.pack(0, RETRY, len(give), len(take)) + pieces)

    def _done(self, unique: int, result: int, data: bytes = b"") -> None:
        self._answer(unique, 0, _IOCTL_OUT.pack(result, 0, 0, 0) + data)

    def close(self) -> None:
        """Take the device away."""
        os.write(self._stopper, b"x")
        self._thread.join()
        for each in (self._file, self._stop, self._stopper):
            os.close(each)
