"""Publish what an MPU6050 measures: `imu/data_raw`, `imu/temperature`, `/diagnostics`."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any

from sensor_msgs.msg import Imu, Temperature

from ..errors import ConfigurationError
from ..parameters.bounds import Bounds, Meaning
from ..ros_messages import set_stamp
from ..sensors.i2c import I2cRegisters, Registers
from ..sensors.mpu6050 import PACKET_BYTES, ImuReading, Mpu6050, Mpu6050Settings, Reading
from ..sensors.mpu6050_reader import Counters, Mpu6050Reader
from ..sensors.simulated_mpu6050 import SimulatedMpu6050
from ..streams.messages import RawImuEncoder
from .declarations import declarations_of, settings_from
from .diagnostics import Diagnostics, Level, Report
from .lifecycle import DeviceNode
from .parameters import NodeParameters
from .qos import overridable, published
from .robot_agreement import CHIP, stated_ranges
from .spin import run

TEMPERATURE_PERIOD = 0.1
"""Time between two temperatures [s]."""
FAILED_ATTEMPTS = 5
"""Attempts to set the chip up before the bus itself is closed and opened again."""
RANGE_TOLERANCE = 0.01
"""Relative difference between two full scales that is taken for rounding."""
AT_ANY_TIME = {"gyro_stddev", "accel_stddev"}
"""Parameters of the chip that only concern messages."""


@dataclass(frozen=True, slots=True)
class StatedRanges:
    """Full scales that the correction uses; a difference from the chip's is reported."""

    gyro_range: Annotated[
        float, Bounds(0.0, 100.0, "rad/s", "As in robot.yaml; 0 where it is not given.")
    ] = 0.0
    accel_range: Annotated[
        float, Bounds(0.0, 1000.0, "m/s^2", "As in robot.yaml; 0 where it is not given.")
    ] = 0.0

    def difference(self, chip: Mpu6050Settings) -> str:
        """Return in words what differs from the chip's set-up; empty where all agrees."""
        found = []
        for name, stated, true in (
            ("gyro_range", self.gyro_range, chip.gyro_range),
            ("accel_range", self.accel_range, chip.accel_range),
        ):
            if stated and abs(stated / true - 1.0) > RANGE_TOLERANCE:
                found.append(f"robot.{name} is {stated:.6g}, the chip is set to {true:.6g}")
        return "; ".join(found)


@dataclass(frozen=True, slots=True)
class Mpu6050NodeSettings:
    """Parameters of the node."""

    frame_id: Annotated[str, Meaning("Frame of the sensor's axes.")] = "imu_link"
    simulated: Annotated[
        bool, Meaning("Read a simulated chip that swings gently, instead of the bus.")
    ] = False
    mpu6050: Annotated[Mpu6050Settings, Meaning("The chip.")] = field(
        default_factory=Mpu6050Settings
    )
    robot: Annotated[
        StatedRanges,
        Meaning("Chip settings of `robot.yaml`, where it is given to this node too."),
    ] = field(default_factory=StatedRanges)


class Mpu6050Node(DeviceNode):
    """Lifecycle node around `Mpu6050Reader`."""

    def __init__(
        self,
        registers: Registers | None = None,
        listener: Callable[[int, tuple[float, ...]], None] | None = None,
        **options: Any,
    ) -> None:
        """Create the node.

        Args:
            registers: A chip to read instead of the bus, such as a simulated one.
            listener: Called with stamp [ns], gyro x, y, z [rad/s] and accelerometer x, y, z
                [m/s^2] of each sample, for a correction in the same process; then only what
                somebody subscribed to is published.
            options: For `rclpy.node.Node`.
        """
        super().__init__("mpu6050_node", **options)
        self._registers, self._listener = registers, listener
        self.reader: Mpu6050Reader | None = None
        self._temperature = Temperature()
        self._until_temperature = 0
        self._counters, self._reported = Counters(), Counters()
        self._imu_publisher = self.create_lifecycle_publisher(
            Imu, "imu/data_raw", published(), qos_overriding_options=overridable()
        )
        self._temperature_publisher = self.create_lifecycle_publisher(
            Temperature, "imu/temperature", published(), qos_overriding_options=overridable()
        )
        self.parameters = NodeParameters(
            self,
            declarations_of(Mpu6050NodeSettings()),
            Mpu6050NodeSettings(),
            self._build,
            self._apply,
        )
        self._apply(self.parameters.current)
        self._diagnostics = Diagnostics(self, self.report, self._hardware_id())
        self.begin()

    def _build(self, former: Mpu6050NodeSettings, values: Mapping[str, Any]) -> Mpu6050NodeSettings:
        settings = settings_from(former, values)
        if self.is_open:
            old, new = asdict(former), asdict(settings)
            for name in AT_ANY_TIME:
                del old["mpu6050"][name], new["mpu6050"][name]
            for name in ("frame_id", "robot"):
                del old[name], new[name]
            if old != new:
                raise ConfigurationError(
                    "the set-up of the chip can only change while the node is unconfigured"
                )
        return settings

    def _apply(self, settings: Mpu6050NodeSettings) -> None:
        """Lay out the messages: what stays the same from sample to sample."""
        chip = settings.mpu6050
        self._temperature.header.frame_id = settings.frame_id
        self._encoder = RawImuEncoder(settings.frame_id, chip.gyro_stddev**2, chip.accel_stddev**2)

    def _hardware_id(self) -> str:
        settings = self.parameters.current
        if self._registers is not None or settings.simulated:
            return "simulated MPU6050"
        return f"MPU6050 at 0x{settings.mpu6050.address:02x} on /dev/i2c-{settings.mpu6050.bus}"

    def open_device(self) -> None:
        """Open the bus and set the chip up."""
        settings = self.parameters.current
        chip = settings.mpu6050
        registers = self._registers
        if registers is None:
            registers = (
                SimulatedMpu6050(self.clock_now, reset_time=0.0)
                if settings.simulated
                else I2cRegisters(chip.bus, chip.address)
            )
        # Simulated time pauses and jumps, and the waits of its chip with it.
        simulated_time = self.get_parameter("use_sim_time").value
        monotonic = self.clock_now if settings.simulated and simulated_time else time.monotonic_ns
        device = Mpu6050(registers, chip)
        self.reader = Mpu6050Reader(device, self.clock_now, monotonic, counters=self._counters)
        try:
            remark = self.reader.start()
        except Exception:
            self.reader.stop()
            raise
        if remark:
            self._say(remark, warning=not device.model.known)
        if difference := settings.robot.difference(chip):
            self._say(difference, warning=True)
        self._timer = self.poll_timer(1.0 / chip.poll_rate, self._poll)

    def _say(self, text: str, warning: bool) -> None:
        """Log it; rclpy ties a severity to the line that logs."""
        if warning:
            self.get_logger().warning(text)
        else:
            self.get_logger().info(text)

    def close_device(self) -> None:
        """Release the bus."""
        self.destroy_timer(self._timer)
        if self.reader is not None:
            self.reader.stop()

    def _poll(self) -> None:
        if self.reader is None:
            return
        readings = self.reader.poll()  # while inactive too: the chip stays watched
        if self.reader.failed_attempts >= FAILED_ATTEMPTS:
            self.lose_device(self.reader.last_error)
            return
        if self.is_active and readings:
            wanted = self._listener is None or self._imu_publisher.get_subscription_count() > 0
            for reading in readings:
                self._publish(reading, wanted)

    def _publish(self, reading: ImuReading, wanted: bool) -> None:
        """Pass a reading on; publish it where it is `wanted` as a message."""
        stamp, readings = reading[0], reading[1:7]
        if self._listener is not None:
            self._listener(stamp, readings)
        if wanted:
            data = self._encoder.encode(stamp, readings[:3], readings[3:])
            self._imu_publisher.publish(data)
        self._until_temperature -= 1
        if self._until_temperature <= 0:
            rate_now = self.parameters.current.mpu6050.delivered_rate
            self._until_temperature = round(TEMPERATURE_PERIOD * rate_now)
            set_stamp(self._temperature, stamp)
            self._temperature.temperature = reading.temperature
            self._temperature_publisher.publish(self._temperature)

    def report(self) -> Report:
        """Return the status for `/diagnostics`: the counters and their changes since."""
        if self.reader is None or not self.is_open:
            return self.idle_report({})
        counters, before = self.reader.counters, self._reported
        chip = self.parameters.current.mpu6050
        values: dict[str, object] = {"phase": self.reader.phase.value, **asdict(counters)}
        values[CHIP] = stated_ranges(chip.gyro_range, chip.accel_range)
        if self.parameters.current.mpu6050.reading is Reading.FIFO:
            values["largest_transfer"] = self.reader.fifo.transfer_packets * PACKET_BYTES
            values["sample_clock_drift_ppm"] = round(self.reader.sample_clock.drift * 1e6, 1)
        new = {key: n - getattr(before, key) for key, n in asdict(counters).items()}
        self._reported = Counters(**asdict(counters))
        samples = new.pop("samples")
        if not self.is_active:
            return self.idle_report(values)
        return Report(*self._verdict(self.reader, samples, any(new.values())), values)

    def _verdict(self, reader: Mpu6050Reader, samples: int, disturbed: bool) -> tuple[Level, str]:
        """Return the worst of the messages."""
        if not reader.running or (not samples and self.is_settled):
            return Level.ERROR, reader.last_error or "no samples"
        if reader.defect:
            return Level.ERROR if reader.broken else Level.WARN, reader.defect
        if disturbed:
            return Level.WARN, reader.last_error or "disturbed bus"
        settings = self.parameters.current
        if difference := settings.robot.difference(settings.mpu6050):
            return Level.WARN, difference
        return Level.OK, f"{samples} samples since the last report"


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    return run(Mpu6050Node, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
