"""Publish the IMU and the wheels of a microcontroller on a serial port.

Lines as `twbr import` describes them, or binary frames with a checksum, become `imu/data_raw` and
`joint_states`, stamped by the device's clock related to ours, or by their arrival. The port is
opened again when it was unplugged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

from sensor_msgs.msg import Imu, JointState

from ..errors import ConfigurationError
from ..parameters.bounds import Bounds, Meaning, require_bounds
from ..ros_messages import (
    ACCEL,
    ACCEL_COVARIANCE,
    GYRO,
    GYRO_COVARIANCE,
    IMU_DOUBLES,
    ORIENTATION_COVARIANCE,
    UNREPORTED,
)
from ..samples import SINGLE_WHEEL_JOINT, Stamps
from ..streams.device.binary_frames import TICK, WRAP, DeviceSample, decode_frame
from ..streams.device.clock import DeviceClock
from ..streams.device.lines import NANOSECOND, LineDecoder
from ..streams.device.port import PortStream, text_decoder
from ..streams.messages import ImuEncoder, JointStateEncoder
from .declarations import declarations_of, settings_from, with_choices
from .diagnostics import Diagnostics, Level, Report
from .lifecycle import DeviceNode
from .parameters import NodeParameters
from .qos import overridable, published
from .spin import run

CLOCKS = (Stamps.DEVICE, Stamps.ARRIVAL)
"""Clocks that can stamp what has no header."""


class Format(Enum):
    """Format of the bytes on the port."""

    LINES = "lines"
    FRAMES = "frames"


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """Parameters of the node."""

    port: Annotated[str, Meaning("Serial port; a path below /dev/serial/by-id stays the same.")] = (
        "/dev/ttyUSB0"
    )
    baud_rate: Annotated[int, Bounds(300, 12_000_000, "1/s", "Speed of the port.")] = 115200
    format: Annotated[Format, Meaning("`lines` of text, or `frames`: COBS with a checksum.")] = (
        Format.LINES
    )
    description: Annotated[
        str, Meaning("With `lines`: the YAML file that `twbr import --columns` takes.")
    ] = ""
    stamps: Annotated[
        Stamps,
        Meaning("`device`: its clock, related to ours; `arrival`: when the bytes came."),
    ] = Stamps.DEVICE
    poll_rate: Annotated[float, Bounds(10.0, 2000.0, "Hz", "How often the port is read.")] = 500.0
    frame_id: Annotated[str, Meaning("Frame of the sensor's axes.")] = "imu_link"
    joint_names: Annotated[
        tuple[str, ...], Meaning("Joints of the left and the right wheel, or of the only one.")
    ] = ("left_wheel_joint", "right_wheel_joint")
    gyro_stddev: Annotated[
        float, Bounds(0.0, 1.0, "rad/s", "Of one reading; 0 where it is unknown.")
    ] = 0.0
    accel_stddev: Annotated[
        float, Bounds(0.0, 10.0, "m/s^2", "Of one reading; 0 where it is unknown.")
    ] = 0.0

    def __post_init__(self) -> None:
        """Check numbers against their bounds, and what must go together.

        Raises:
            ConfigurationError: a value out of bounds, or a combination that cannot work.
        """
        require_bounds(self)
        if self.stamps not in CLOCKS:
            raise ConfigurationError("stamps: header: a serial port has none; device or arrival")
        if not 1 <= len(self.joint_names) <= 2:
            raise ConfigurationError(f"joint_names: {len(self.joint_names)} given, needed 1 or 2")

    def stream(self) -> PortStream:
        """Return what reads the port.

        Raises:
            ConfigurationError: the description is missing or cannot be used.
        """
        clocked = self.stamps is Stamps.DEVICE
        if self.format is Format.FRAMES:
            return PortStream(decode_frame, b"\0", DeviceClock(TICK, WRAP) if clocked else None)
        if not self.description:
            raise ConfigurationError("description: with format `lines` a YAML file is needed")
        from ..imports.csv_description import read_description  # loads the readers of recordings

        lines = LineDecoder(read_description(Path(self.description).expanduser()))
        clock = DeviceClock(NANOSECOND, lines.ticks_of_wrap) if clocked else None
        return PortStream(text_decoder(lines.decode), b"\n", clock)


class SerialNode(DeviceNode):
    """Lifecycle node around one port."""

    def __init__(self, **options: Any) -> None:
        """Create the node."""
        super().__init__("serial_node", **options)
        declared = with_choices(
            declarations_of(SerialSettings()), "stamps", [each.value for each in CLOCKS]
        )
        self.settings = NodeParameters(self, declared, SerialSettings(), self._build)
        self._port: Any = None
        self._stream: PortStream | None = None
        self._opened = 0
        self._reported = 0
        self._values = [0.0] * IMU_DOUBLES
        self._joints: JointStateEncoder | None = None
        self._last_wheels: tuple[int, tuple[float, ...]] = (0, ())
        self._diagnostics = Diagnostics(self, self.report, "serial port")
        self.begin()

    def _build(self, former: SerialSettings, values: Mapping[str, Any]) -> SerialSettings:
        settings = settings_from(former, values)
        if self.is_open and settings != former:
            raise ConfigurationError("the port can only change while the node is unconfigured")
        return settings

    def open_device(self) -> None:
        """Open the port."""
        settings = self.settings.current
        stream = settings.stream()
        try:
            import serial
        except ImportError:
            raise ConfigurationError(
                "pyserial is missing: apt install python3-serial, or pip install "
                "'twbr_estimation[serial]'"
            ) from None
        try:
            self._port = serial.Serial(settings.port, settings.baud_rate, timeout=0)
        except (serial.SerialException, OSError, ValueError) as error:
            raise ConfigurationError(_advised(settings.port, error)) from None
        self._opened += 1
        self._stream = stream
        self._last_wheels = (0, ())
        self._encoder = ImuEncoder(settings.frame_id)
        self._values[ORIENTATION_COVARIANCE] = UNREPORTED
        for first, deviation in (
            (GYRO_COVARIANCE, settings.gyro_stddev),
            (ACCEL_COVARIANCE, settings.accel_stddev),
        ):
            for axis in (0, 4, 8):
                self._values[first + axis] = deviation**2
        kind = {"qos_overriding_options": overridable()}
        create = self.create_lifecycle_publisher
        self._imu = create(Imu, "imu/data_raw", published(), **kind)
        self._wheels = create(JointState, "joint_states", published(), **kind)
        self._timer = self.poll_timer(1.0 / settings.poll_rate, self._poll)

    def close_device(self) -> None:
        """Release the port."""
        self.destroy_timer(self._timer)
        self.destroy_lifecycle_publisher(self._imu)
        self.destroy_lifecycle_publisher(self._wheels)
        self._port.close()

    def _poll(self) -> None:
        try:
            data = self._port.read(self._port.in_waiting or 1)
        except (OSError, TypeError) as error:  # unplugged; pyserial's own errors are OSErrors
            self.lose_device(f"{self.settings.current.port}: {error}")
            return
        if not data or self._stream is None:
            return
        for stamp, sample in self._stream.add(data, self.clock_now()):
            if self.is_active:
                self._publish(stamp, sample)

    def _publish(self, stamp: int, sample: DeviceSample) -> None:
        values = self._values
        values[GYRO : GYRO + 3] = sample.gyro
        values[ACCEL : ACCEL + 3] = sample.accel
        if sample.wheels:
            self._publish_wheels(stamp, sample.wheels)
        self._imu.publish(self._encoder.encode(stamp, values))

    def _publish_wheels(self, stamp: int, angles: tuple[float, ...]) -> None:
        before, last = self._last_wheels
        self._last_wheels = stamp, angles
        if self._joints is None or len(last) != len(angles):
            names = self.settings.current.joint_names
            fitting = names if len(names) == len(angles) else (SINGLE_WHEEL_JOINT,)
            self._joints = JointStateEncoder(fitting[: len(angles)])
            last = angles
        period = (stamp - before) * 1e-9
        speeds = [(new - old) / period for new, old in zip(angles, last, strict=True)]
        self._wheels.publish(self._joints.encode(stamp, angles, speeds))

    def report(self) -> Report:
        """Return the status for `/diagnostics`."""
        values: dict[str, object] = {"openings": self._opened}
        if self._stream is not None:
            values |= {**self._stream.counts, "clock_restarts": self._stream.restarts}
        if not self.is_open:
            return self.idle_report(values)
        assert self._stream is not None
        counts, port = self._stream.counts, self.settings.current.port
        bad = counts["unreadable"] + counts["dropped_bytes"]
        new, self._reported = bad - self._reported, bad
        if not self.is_active:
            return self.idle_report(values)
        if self.is_settled and not counts["samples"]:
            why = self._stream.problem or "nothing comes"
            return Report(Level.ERROR, f"{port}: no sample: {why}", values)
        if new > 0:
            return Report(Level.WARN, f"{port}: unreadable: {self._stream.problem}", values)
        return Report(Level.OK, "reading", values)


def _advised(port: str, error: Exception) -> str:
    text = str(error)
    if "Permission" in text or "Errno 13" in text:
        text += "; add the user to the group dialout: sudo adduser $USER dialout"
    return f"{port}: cannot be opened: {text}"


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    return run(SerialNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
