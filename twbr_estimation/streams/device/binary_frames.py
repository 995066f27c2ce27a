"""Binary frames of a microcontroller: a fixed layout, a checksum, COBS between zero bytes.

A frame is, before COBS: version (1 byte, 1), time (uint32, microseconds, starts again at 2^32),
gyro x y z [rad/s], accelerometer x y z [m/s^2], wheel angle left and right [rad] (float32 each, NaN
where there is none), CRC-16/XMODEM of all that; little-endian. 39 bytes, 41 on the wire.
"""

from __future__ import annotations

import binascii
import math
import struct
from typing import NamedTuple

from ...errors import TwbrError

VERSION = 1
WRAP = 2**32
TICK = 1e-6
"""Time of one tick [s]."""
_BODY = struct.Struct("<BI8f")
_CHECKSUM = struct.Struct("<H")


class FrameError(TwbrError):
    """A frame that cannot be used: cut, disturbed, or of another version."""


class DeviceSample(NamedTuple):
    """One sample as a device sent it."""

    ticks: int | None
    """Its clock; None where it sends no time."""
    gyro: tuple[float, ...]
    """Rates about x, y, z [rad/s]."""
    accel: tuple[float, ...]
    """Specific force [m/s^2]."""
    wheels: tuple[float, ...]
    """Wheel angles [rad]: none, one, or left and right."""


def encode_frame(sample: DeviceSample) -> bytes:
    """Return a frame as it goes over the wire, its closing zero included."""
    from cobs import cobs

    wheels = (*sample.wheels, math.nan, math.nan)[:2]
    body = _BODY.pack(VERSION, (sample.ticks or 0) % WRAP, *sample.gyro, *sample.accel, *wheels)
    checksum = _CHECKSUM.pack(binascii.crc_hqx(body, 0))
    return bytes(cobs.encode(body + checksum)) + b"\0"


def decode_frame(data: bytes) -> DeviceSample:
    """Return the sample of one frame, without the zero that closes it.

    Raises:
        FrameError: the frame is cut or disturbed, or has a number that is not finite.
    """
    from cobs import cobs

    try:
        plain = cobs.decode(data)
    except cobs.DecodeError as error:
        raise FrameError(f"a frame of {len(data)} bytes is no COBS: {error}") from None
    if len(plain) != _BODY.size + _CHECKSUM.size:
        wanted = _BODY.size + _CHECKSUM.size
        raise FrameError(f"a frame has {len(plain)} bytes, needed are {wanted}")
    body = plain[: _BODY.size]
    if _CHECKSUM.unpack_from(plain, _BODY.size)[0] != binascii.crc_hqx(body, 0):
        raise FrameError("the checksum of a frame is wrong")
    version, ticks, *values = _BODY.unpack(body)
    if version != VERSION:
        raise FrameError(f"a frame has version {version}, known is {VERSION}")
    if not all(map(math.isfinite, values[:6])):
        raise FrameError("a frame has a reading that is not finite")
    wheels = tuple(each for each in values[6:] if math.isfinite(each))
    return DeviceSample(ticks, tuple(values[:3]), tuple(values[3:6]), wheels)
