"""Serialised messages (XCDR version 1, as DDS carries them) to numbers and back.

A node that subscribes and publishes raw bytes saves most of the time rclpy spends on
building message objects. A message starts with four bytes of encapsulation; alignment
counts from the byte after them. `bags` decodes whole batches of the same format.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache

from ..errors import MessageError
from ..pipeline.pairing import MotorCommand, motor_command
from ..pipeline.physical import LARGEST_VOLTAGE
from ..ros_messages import (
    ACCEL,
    ACCEL_COVARIANCE,
    GYRO,
    GYRO_COVARIANCE,
    IMU_DOUBLES,
    ORIENTATION,
    ORIENTATION_COVARIANCE,
    POSE_DOUBLES,
)
from ..samples import NANOSECONDS_PER_SECOND

_STAMP = 4  # header first: seconds, nanoseconds, then the frame id
_FRAME = 12
_LITTLE_ENDIAN = b"\x00\x01"

_read_stamp = struct.Struct("<iII").unpack_from
_write_stamp = struct.Struct("<iI").pack_into
_write_vector = struct.Struct("<3d").pack_into
_read_count = struct.Struct("<I").unpack_from
_imu = struct.Struct(f"<{IMU_DOUBLES}d")
_raw_imu = struct.Struct(f"<{8 * GYRO}x3d{8 * 9}x3d{8 * 9}x")


def _aligned(offset: int, size: int) -> int:
    """Return the next offset where an item of `size` bytes may lie."""
    return offset + (_STAMP - offset) % size


def decode_imu(data: bytes) -> tuple[int, tuple[float, ...]]:
    """Return stamp [ns] and the 37 doubles of a serialised `sensor_msgs/Imu`.

    Raises:
        MessageError: not an Imu in little-endian XCDR version 1.
    """
    return _decoded_imu(data, _imu)


def decode_raw_imu(data: bytes) -> tuple[int, tuple[float, ...]]:
    """Return stamp [ns] and gyro x, y, z, accelerometer x, y, z of a serialised Imu.

    Raises:
        MessageError: not an Imu in little-endian XCDR version 1.
    """
    return _decoded_imu(data, _raw_imu)


def _decoded_imu(data: bytes, layout: struct.Struct) -> tuple[int, tuple[float, ...]]:
    try:
        seconds, nanoseconds, length = _read_stamp(data, _STAMP)
        values = layout.unpack_from(data, _aligned(_FRAME + 4 + length, 8))
    except struct.error as error:
        raise MessageError(f"an Imu of {len(data)} bytes cannot be read: {error}") from None
    _require_encoding(data)
    _require_time(nanoseconds)
    return seconds * NANOSECONDS_PER_SECOND + nanoseconds, values


def frame_id(data: bytes) -> str:
    """Return the frame id of a serialised message that begins with a header."""
    length = int(_read_count(data, _FRAME)[0])
    return data[_FRAME + 4 : _FRAME + 3 + length].decode("utf-8", "replace")


def _require_encoding(data: bytes) -> None:
    if data[:2] != _LITTLE_ENDIAN:
        raise MessageError(
            f"encapsulation 0x{data[:2].hex()}; only 0x0001, little-endian XCDR version 1, is known"
        )


def _require_time(nanoseconds: int) -> None:
    if nanoseconds >= NANOSECONDS_PER_SECOND:
        raise MessageError(f"a stamp with {nanoseconds} ns; a second has {NANOSECONDS_PER_SECOND}")


class ImuEncoder:
    """Serialises Imu messages of one frame id into a reused buffer."""

    def __init__(self, frame: str) -> None:
        """Lay out the message for this frame id."""
        head = _header(frame)
        self._values = _aligned(len(head), 8)
        self._buffer = bytearray(self._values + 8 * IMU_DOUBLES)
        self._buffer[: len(head)] = head

    def encode(self, stamp: int, values: Sequence[float]) -> bytes:
        """Return the message with this stamp [ns] and these 37 doubles."""
        _write_stamp(self._buffer, _STAMP, *divmod(stamp, NANOSECONDS_PER_SECOND))
        _imu.pack_into(self._buffer, self._values, *values)
        return bytes(self._buffer)


class RawImuEncoder:
    """Serialises Imu messages without an orientation; only stamp and readings change."""

    def __init__(self, frame: str, gyro_variance: float, accel_variance: float) -> None:
        """Lay out the message.

        Args:
            frame: Frame id.
            gyro_variance: Of each axis [(rad/s)^2].
            accel_variance: The same of the accelerometer [(m/s^2)^2].
        """
        values = [0.0] * IMU_DOUBLES
        values[ORIENTATION + 3] = 1.0
        values[ORIENTATION_COVARIANCE] = -1.0  # REP-145: no orientation
        for axis in range(0, 9, 4):
            values[GYRO_COVARIANCE + axis] = gyro_variance
            values[ACCEL_COVARIANCE + axis] = accel_variance
        self._buffer = bytearray(ImuEncoder(frame).encode(0, values))
        doubles = len(self._buffer) - 8 * IMU_DOUBLES
        self._gyro, self._accel = doubles + 8 * GYRO, doubles + 8 * ACCEL

    def encode(self, stamp: int, gyro: Sequence[float], accel: Sequence[float]) -> bytes:
        """Return the message with this stamp [ns] and these readings along x, y, z."""
        buffer = self._buffer
        _write_stamp(buffer, _STAMP, *divmod(stamp, NANOSECONDS_PER_SECOND))
        _write_vector(buffer, self._gyro, *gyro)
        _write_vector(buffer, self._accel, *accel)
        return bytes(buffer)


class JointStateEncoder:
    """Serialises JointState messages of the same joints: positions, velocities, perhaps efforts."""

    def __init__(self, names: Sequence[str], frame: str = "", *, efforts: bool = False) -> None:
        """Lay out the message for these joints, with or without efforts."""
        count = len(names)
        number = struct.pack("<I", count)
        head = _header(frame) + number + b"".join(map(_text, names)) + number
        self._positions = _aligned(len(head), 8)
        self._velocities = _aligned(self._positions + 8 * count + 4, 8)
        self._doubles = struct.Struct(f"<{count}d").pack_into
        end = self._velocities + 8 * count
        self._efforts = _aligned(end + 4, 8) if efforts else 0
        self._buffer = bytearray(self._efforts + 8 * count if efforts else end + 4)
        self._buffer[: len(head)] = head
        struct.pack_into("<I", self._buffer, self._positions + 8 * count, count)
        struct.pack_into("<I", self._buffer, end, count if efforts else 0)

    def encode(
        self,
        stamp: int,
        positions: Sequence[float],
        velocities: Sequence[float],
        efforts: Sequence[float] = (),
    ) -> bytes:
        """Return the message with this stamp [ns]; `efforts` counts if laid out for them."""
        _write_stamp(self._buffer, _STAMP, *divmod(stamp, NANOSECONDS_PER_SECOND))
        self._doubles(self._buffer, self._positions, *positions)
        self._doubles(self._buffer, self._velocities, *velocities)
        if self._efforts:
            self._doubles(self._buffer, self._efforts, *efforts)
        return bytes(self._buffer)


class JointStateDecoder:
    """Reads serialised JointStates; the layout is looked up once a joint list."""

    def __init__(self) -> None:
        """Begin without a layout."""
        self._layout = b""
        self._names: tuple[str, ...] = ()
        self._read = struct.Struct("<0d")
        self._moving: tuple[str, ...] = ()
        self._velocities = 0

    def decode(self, data: bytes) -> tuple[int, tuple[str, ...], tuple[float, ...]]:
        """Return stamp [ns], joint names and their positions; as many of both.

        The tuple of names stays the same object while the joints stay the same.

        Raises:
            MessageError: not a JointState in little-endian XCDR version 1.
        """
        try:
            if not self._layout or not data.startswith(self._layout, _FRAME):
                self._learn(data)
            seconds, nanoseconds, _ = _read_stamp(data, _STAMP)
            positions = self._read.unpack_from(data)
        except (struct.error, UnicodeDecodeError) as error:
            raise MessageError(f"a JointState of {len(data)} bytes: {error}") from None
        _require_time(nanoseconds)
        return seconds * NANOSECONDS_PER_SECOND + nanoseconds, self._names, positions

    def velocities(self, data: bytes) -> tuple[tuple[str, ...], tuple[float, ...]]:
        """Return names and velocities of the message just decoded, which holds no positions.

        Raises:
            MessageError: the message is torn.
        """
        try:
            count = min(int(_read_count(data, self._velocities)[0]), len(self._moving))
            start = _aligned(self._velocities + 4, 8) if count else 0
            if count < len(self._moving):
                self._moving = self._moving[:count]
            return self._moving, struct.unpack_from(f"<{count}d", data, start)
        except struct.error as error:
            raise MessageError(f"a JointState of {len(data)} bytes: {error}") from None

    def _learn(self, data: bytes) -> None:
        _require_encoding(data)
        _, offset = _string(data, _FRAME)
        names, offset = _strings(data, offset)
        offset = _aligned(offset, 4)
        count = min(int(_read_count(data, offset)[0]), len(names))
        positions = _aligned(offset + 4, 8) if count else 0
        self._layout = data[_FRAME : offset + 4]
        self._names, self._moving = tuple(names[:count]), tuple(names)
        self._velocities = offset + 4  # where no position lies before them
        self._read = struct.Struct(f"<{positions}x{count}d")


def decode_float64s(data: bytes) -> tuple[float, ...]:
    """Return the numbers of a serialised `std_msgs/Float64MultiArray`.

    Raises:
        MessageError: not such a message in little-endian XCDR version 1.
    """
    try:
        values = _float64_array(data)
    except struct.error as error:
        raise MessageError(f"a Float64MultiArray of {len(data)} bytes: {error}") from None
    _require_encoding(data)
    return values


def decode_motor_command(arrival: int, data: bytes) -> MotorCommand:
    """Return the command in a serialised `std_msgs/Float64MultiArray` that came at `arrival` [ns].

    Raises:
        MessageError: not such a message in little-endian XCDR version 1, or not one or two
            finite voltages in it.
    """
    voltages = decode_float64s(data)
    if len(voltages) not in (1, 2) or not all(abs(each) <= LARGEST_VOLTAGE for each in voltages):
        raise MessageError(
            f"motor command {list(voltages[:4])}: one or two finite voltages, at most "
            f"{LARGEST_VOLTAGE:g} V, are needed"
        )
    return motor_command(arrival, voltages)


def _float64_array(data: bytes) -> tuple[float, ...]:
    offset = _STAMP + 4
    for _ in range(_read_count(data, _STAMP)[0]):  # dimensions: label, size, stride
        offset = _aligned(offset, 4)
        offset = _aligned(offset + 4 + int(_read_count(data, offset)[0]), 4) + 8
    offset = _aligned(offset, 4) + 4  # data_offset
    count = int(_read_count(data, offset)[0])
    if count > len(data) // 8:
        raise struct.error(f"{count} doubles do not fit")
    return struct.unpack_from(f"<{count}d", data, _aligned(offset + 4, 8) if count else 0)


def encode_float64s(values: Sequence[float]) -> bytes:
    """Return a serialised `std_msgs/Float64MultiArray` without dimensions."""
    return struct.pack(f"<4I4x{len(values)}d", 0x00000100, 0, 0, len(values), *values)


def decode_float64(data: bytes) -> float:
    """Return the number of a serialised `std_msgs/Float64`.

    Raises:
        MessageError: not a Float64 in little-endian XCDR version 1.
    """
    try:
        value = float(_FLOAT64.unpack_from(data)[1])
    except struct.error as error:
        raise MessageError(f"a Float64 of {len(data)} bytes: {error}") from None
    _require_encoding(data)
    return value


def decode_temperature(data: bytes) -> float:
    """Return the temperature [degC] of a serialised `sensor_msgs/Temperature`.

    Raises:
        MessageError: not a Temperature in little-endian XCDR version 1.
    """
    try:
        length = _read_stamp(data, _STAMP)[2]
        value = float(_DOUBLE.unpack_from(data, _aligned(_FRAME + 4 + length, 8))[0])
    except struct.error as error:
        raise MessageError(f"a Temperature of {len(data)} bytes: {error}") from None
    _require_encoding(data)
    return value


def decode_forward_speed(data: bytes) -> tuple[int, float]:
    """Return stamp [ns] and forward speed [m/s] of a serialised `nav_msgs/Odometry`.

    Raises:
        MessageError: not an Odometry in little-endian XCDR version 1.
    """
    try:
        seconds, nanoseconds, length = _read_stamp(data, _STAMP)
        child = _aligned(_FRAME + 4 + length, 4)
        twist = _aligned(child + 4 + int(_read_count(data, child)[0]), 8) + 8 * POSE_DOUBLES
        speed = float(_DOUBLE.unpack_from(data, twist)[0])
    except struct.error as error:
        raise MessageError(f"an Odometry of {len(data)} bytes cannot be read: {error}") from None
    _require_encoding(data)
    _require_time(nanoseconds)
    return seconds * NANOSECONDS_PER_SECOND + nanoseconds, speed


def encode_float64(value: float) -> bytes:
    """Return a serialised `std_msgs/Float64`."""
    return _FLOAT64.pack(0x00000100, value)


class DiagnosticEncoder:
    """Serialises DiagnosticArrays of one status, that of the same part of a robot."""

    def __init__(self, name: str, hardware_id: str) -> None:
        """Lay out the status of this name, about this device."""
        self._head = _header("") + struct.pack("<I", 1)
        self._name, self._hardware_id = _text(name), _text(hardware_id)

    def encode(self, stamp: int, level: bytes, message: str, values: Mapping[str, str]) -> bytes:
        """Return the message with this stamp [ns], level, sentence, and values by name."""
        found = [self._head, level, b"\0\0\0", self._name, _text(message), self._hardware_id]
        found.append(struct.pack("<I", len(values)))
        for key, value in values.items():
            found += _text(key), _text(value)
        data = bytearray().join(found)
        _write_stamp(data, _STAMP, *divmod(stamp, NANOSECONDS_PER_SECOND))
        return bytes(data)


def diagnostic_values(data: bytes, keys: Collection[str]) -> list[tuple[str, str, str]]:
    """Return status, key and value of those with these keys in a serialised DiagnosticArray.

    Raises:
        MessageError: not a DiagnosticArray in little-endian XCDR version 1.
    """
    found = []
    wanted = {key.encode() + b"\0": key for key in keys}
    try:
        end = _aligned(_end_of_text(data, _FRAME), 4) + 4
        for _ in range(_read_count(data, end - 4)[0]):
            name = _aligned(end + 1, 4)  # after the level
            sentence = _aligned(_end_of_text(data, name), 4)
            device = _aligned(_end_of_text(data, sentence), 4)
            end = _aligned(_end_of_text(data, device), 4) + 4
            for _ in range(_read_count(data, end - 4)[0]):
                begin = _aligned(end, 4)
                end = _end_of_text(data, begin)
                key, value = wanted.get(data[begin + 4 : end]), _aligned(end, 4)
                end = _end_of_text(data, value)
                if key is not None:
                    found.append((_string(data, name)[0], key, _string(data, value)[0]))
    except (struct.error, UnicodeDecodeError) as error:
        raise MessageError(f"a DiagnosticArray of {len(data)} bytes: {error}") from None
    _require_encoding(data)
    return found


def _end_of_text(data: bytes, offset: int) -> int:
    return offset + 4 + int(_read_count(data, offset)[0])


@lru_cache(maxsize=512)
def _text(text: str) -> bytes:
    """Return a serialised string, filled up to where the next one begins."""
    data = text.encode(errors="replace") + b"\0"  # of a path, it may hold what is no text
    return struct.pack("<I", len(data)) + data + bytes(-len(data) % 4)


def _header(frame: str) -> bytes:
    return _LITTLE_ENDIAN + bytes(2 + 8) + _text(frame)


def _string(data: bytes, offset: int) -> tuple[str, int]:
    offset = _aligned(offset, 4)
    (length,) = _read_count(data, offset)
    end = offset + 4 + length
    return data[offset + 4 : end - 1].decode(), end


def _strings(data: bytes, offset: int) -> tuple[list[str], int]:
    offset = _aligned(offset, 4)
    (count,) = _read_count(data, offset)
    offset += 4
    names = []
    for _ in range(count):
        name, offset = _string(data, offset)
        names.append(name)
    return names, offset


_FLOAT64 = struct.Struct("<Id")
_DOUBLE = struct.Struct("<d")
