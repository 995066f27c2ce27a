"""`imu/data_raw` and `joint_states` to `imu/data_corrected`: calibrated, in body axes.

The orientation of what is published is the angle of Laddach 2022 (13) about +y. `imu/valid` is
false where gyro, accelerometer and wheels contradict each other: then `tilt/valid` of a filter_node
in another process is false, too, whether its filter uses the wheels or not.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from sensor_msgs.msg import Imu, Temperature
from std_msgs.msg import Bool

from ..checks.finding import sentences
from ..checks.live import LiveChecks
from ..checks.quick import QuickChecks
from ..pipeline.pairing import MotorCommand, WheelReading, wheel_reading
from ..robot import Setup
from ..samples import CorrectedSample, Sample
from ..streams.corrected import imu_values
from ..streams.correction import CorrectionStream
from ..streams.device.stamping import Stamping
from ..streams.guarded import StampedSamples, came_instead
from ..streams.inputs import InputSettings, wheel_input
from ..streams.messages import ImuEncoder, decode_raw_imu, decode_temperature
from .calibration_service import CalibrationService
from .declarations import declarations_of, settings_from
from .diagnostics import Diagnostics, Level, Report
from .guard import GuardedNode
from .inputs import IMU_FRAME, MachineCode, listen_to_wheels
from .mounting import MountingFromFrames
from .parameters import NodeParameters, declare, declare_settings
from .qos import latched, listen, overridable, published
from .robot_agreement import ROBOT, stated
from .spin import run
from .watchdog import Watchdog

KEPT_SAMPLES = 5_000
"""Raw samples kept for a calibration: five seconds at 1 kHz."""


class CorrectionNode(GuardedNode):
    """Subscribes, corrects, publishes; the work is done by a `CorrectionStream`."""

    def __init__(
        self,
        listener: Callable[[int, CorrectedSample], None] | None = None,
        subscribe: bool = True,
        **options: Any,
    ) -> None:
        """Create the node.

        Args:
            listener: Called with stamp [ns] and sample before each publication, for a filter
                in the same process; then only topics with a subscriber are published.
            subscribe: False where drivers in the same process call `take_imu` and
                `take_wheels`.
            options: Options of `rclpy.node.Node`.
        """
        super().__init__("correction_node", **options)
        inputs = declare_settings(self, InputSettings())
        self.wheel_joints = inputs.left_wheel_joint, inputs.right_wheel_joint
        setup = NodeParameters(
            self,
            declarations_of(Setup()),
            Setup(),
            settings_from,
            self._configure,
        )
        self._checks = LiveChecks(setup.current)
        self._quick, self._was_valid = QuickChecks(), True
        self._stream = CorrectionStream(
            setup.current, inputs.wheel_wait, KEPT_SAMPLES, inputs.loop_period, self._checks
        )
        self._setup, self._listener = setup, listener
        self._mounting = MountingFromFrames(self, lambda: setup.current.robot)
        self._calibration = CalibrationService(
            self, lambda: setup.current, self._recent, lambda: self._stream.temperature
        )
        self._inputs = inputs
        self._wheels = wheel_input(inputs, lambda: setup.current.robot.wheel_radius)
        self._stamping = Stamping(inputs.stamps, "imu/data_raw")
        self.pass_wheels: Callable[[WheelReading], None] | None = None
        """Called with each reading of the wheels, for a controller in the same process."""
        self.pass_change: Callable[[], None] | None = None
        """Called when the setup has changed, for a filter in the same process."""
        self._connect(subscribe)
        self._code = MachineCode(self, lambda steps: self._stream.use(steps.correction()))
        self._watchdog = Watchdog(self, inputs.timeout, self._tick)
        self._diagnostics = Diagnostics(self, self._report)

    def _connect(self, subscribe: bool) -> None:
        frame = declare(self, IMU_FRAME)
        self._encoder = ImuEncoder(frame)
        self._publisher = self.create_publisher(
            Imu, "imu/data_corrected", published(), qos_overriding_options=overridable()
        )
        self._valid = self.create_publisher(Bool, "imu/valid", latched())
        listen(self, Temperature, "imu/temperature", self._on_temperature)
        if subscribe:
            listen(self, Imu, "imu/data_raw", self._on_imu)
            listen_to_wheels(self, self._inputs, self._on_joints)

    def _configure(self, setup: Setup) -> None:
        self._stream.configure(setup)
        self._quick.restart()
        if self.pass_change is not None:
            self.pass_change()

    def take_imu(self, stamp: int, values: tuple[float, ...]) -> None:
        """Take gyro x, y, z [rad/s] and accelerometer x, y, z [m/s^2] stamped `stamp` [ns]."""
        self._take(self._stream.add_imu(stamp, values))

    def take_wheels(self, reading: WheelReading) -> None:
        """Take a reading of the wheel encoders."""
        if self.pass_wheels is not None:
            self.pass_wheels(reading)
        self._take(self._stream.add_wheels(reading))

    def take_joints(self, stamp: int, angles: Mapping[str, float]) -> None:
        """Take angles [rad] by joint, stamped `stamp` [ns]; joints that are no wheels are left."""
        found = [angles[name] for name in self.wheel_joints if name in angles]
        if found:
            self.take_wheels(wheel_reading(stamp, found))

    def take_motors(self, command: MotorCommand) -> None:
        """Take a command to the motors, for a filter in the same process."""
        self._stream.add_motors(command)

    def _on_imu(self, data: bytes) -> None:
        stamp, values = decode_raw_imu(data)
        self.take_imu(self._stamping.stamp(stamp, self.clock_now()), values)

    def _on_temperature(self, data: bytes) -> None:
        self._stream.add_temperature(decode_temperature(data))

    def _on_joints(self, data: bytes) -> None:
        reading = self._wheels.decode(data, self.clock_now())
        if reading is not None:
            self.take_wheels(reading)

    def _take(self, corrected: StampedSamples) -> None:
        if corrected:
            self._watchdog.feed()
            self._publish(corrected)

    def _publish(self, corrected: StampedSamples) -> None:
        for stamp, sample in corrected:
            if self._listener is not None:
                self._listener(stamp, sample)
                if not self._is_heard():
                    continue
            self._judge(sample)
            values = imu_values(sample, sample.angle, sample.angle_variance, sample.gyro_y)
            self._publisher.publish(self._encoder.encode(stamp, values))

    def _is_heard(self) -> bool:
        """Whether corrected samples leave this process."""
        return self._listener is None or self._publisher.get_subscription_count() > 0

    def _judge(self, sample: CorrectedSample) -> None:
        """Look for contradictions in what is published; a listener looks by itself."""
        self._quick.add(sample)
        if self._was_valid is bool(self._quick.untrusted):
            self._say_valid()

    def _say_valid(self) -> None:
        self._was_valid = not self._quick.untrusted
        self._valid.publish(Bool(data=self._was_valid))

    def _warmth(self) -> dict[str, object]:
        """Return the temperature that the gyro biases are taken at, where they depend on it."""
        slope = self._setup.current.calibration.gyro_bias_slope
        if not any(slope):
            return {}
        known = self._stream.temperature
        return {"bias_temperature_degC": "not known" if known is None else known}

    def _recent(self) -> list[Sample]:
        return list(self._stream.recent) if self._watchdog.fresh else []

    def _tick(self) -> None:
        self._code.look()
        if not self._watchdog.fresh:
            self._publish(self._stream.flush())
        if self._is_heard():
            self._say_valid()

    def _report(self) -> Report:
        stream = self._stream
        values: dict[str, object] = {
            "calibrated": self._calibration.calibrated,
            ROBOT: stated(self._setup.current.robot),
            **self._warmth(),
            **stream.counts,
            **{f"imu_{name}": count for name, count in stream.imu_guard.counts.items()},
            **{f"wheel_{name}": count for name, count in stream.wheel_guard.counts.items()},
            "wheel_velocities_integrated": self._wheels.rates.messages,
            **{f"imu_{name}": count for name, count in self._stamping.counts().items()},
            "unreadable_messages": self.unreadable,
            "machine_code": self._code.shown,
        }
        stampings, now = (self._stamping, self._wheels.stamping), self.clock_now()
        values |= {name: text for each in stampings for name, text in each.remark(now).items()}
        stamps = "; ".join(each.problem for each in stampings if each.problem)
        if not self._watchdog.started:
            skipped = {**stream.imu_guard.counts, "unreadable": self.unreadable}
            text = stamps or came_instead("waiting for imu/data_raw", skipped)
            return Report(Level.WARN, text, values)
        if not self._watchdog.fresh:
            age = self._watchdog.age
            return Report(Level.ERROR, f"no usable sample on imu/data_raw for {age:.1f} s", values)
        if self._quick.untrusted:
            return Report(Level.ERROR, sentences(self._quick.untrusted), values)
        if self._setup.current.correction.wheel and not stream.wheels_known:
            text = "no wheel readings: their terms are left out"
            return Report(Level.WARN, f"{text}; {stamps}" if stamps else text, values)
        found = sentences(self._checks.look(time.monotonic()))
        if problems := "; ".join(filter(None, (stamps, self._mounting.problem, found))):
            return Report(Level.WARN, problems, values)
        if repeated := stream.wheels_repeated:
            text = f"wheel readings are repeated for {1e3 * repeated:.0f} ms: send each once"
            return Report(Level.WARN, text, values)
        if self._wheels.rates.messages:
            return Report(Level.OK, "correcting; wheel angles integrated from velocities", values)
        return Report(Level.OK, "correcting", values)


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    return run(CorrectionNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
