"""Keep the robot upright: tilt, wheels and velocity commands to the motors.

`motor/command` is [left, right] in V, positive driving forward; `motor/torque`, on request, the
same in N m at the wheels. The motors are cut, which is a command of zeros, until the robot has been
stood up, when it falls, when tilt or wheels fall silent, when the tilt's stamp is not of now or its
value is frozen, when `tilt/valid` is false, while `~/enable` has it disabled, and once as the node
is deactivated or ends by SIGINT, SIGTERM or SIGHUP. A thread of its own cuts them where the node
is stuck. The controller, its parameters and the robot change between two steps.
"""

from __future__ import annotations

import math
import time
from threading import Thread
from typing import Any

from geometry_msgs.msg import Twist, TwistStamped
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64, Float64MultiArray
from std_srvs.srv import SetBool

from ..controllers.base import MotorVoltages
from ..pipeline.pairing import WheelReading
from ..pipeline.physical import NOT_FINITE
from ..ros_messages import GYRO, ORIENTATION, ORIENTATION_COVARIANCE, tilt_of_quaternion
from ..samples import TiltEstimate
from ..streams.control.balance import NO_VOLTAGE, Standing
from ..streams.control.deadline import Deadline
from ..streams.control.motors import UNINTERRUPTED, ControlConfiguration, ControlStream
from ..streams.corrected import has_angle, is_default
from ..streams.messages import decode_float64, decode_imu, encode_float64s
from ..streams.wheels import WheelDecoder
from .controller_parameters import (
    ControllerInputs,
    TiltSource,
    declare_controller_parameters,
    prepare,
)
from .diagnostics import Diagnostics, Level, Report
from .lifecycle import ManagedNode
from .motor_watch import MotorWatch
from .output import never_wait
from .parameters import declare_settings
from .qos import listen, overridable, published, subscribed
from .robot_agreement import ROBOT, stated
from .spin import run
from .watchdog import PERIOD, wall_timer

STOP_TIMEOUT = Duration(nanoseconds=200_000_000)
"""How long the last command is waited for to arrive."""


class ControllerNode(ManagedNode):
    """Subscribes, steps a `ControlStream`, publishes."""

    def __init__(self, subscribe: bool = True, **options: Any) -> None:
        """Create the node.

        Args:
            subscribe: False where an estimation in the same process calls `take_estimate`,
                `take_valid` and `take_wheels`.
            options: Options of `rclpy.node.Node`.

        Raises:
            ConfigurationError: a parameter that cannot be used.
        """
        super().__init__("controller_node", **options)
        self._inputs = declare_settings(self, ControllerInputs())
        self._chosen = declare_controller_parameters(self, self._configure)
        self._stream = ControlStream(self._chosen.current)
        given = self._inputs
        self._wheels = WheelDecoder(
            given.left_wheel_joint, given.right_wheel_joint, given.wheel_gear_ratio, given.stamps
        )
        self._arrival = 0
        self._arrived = time.monotonic()
        self._deadline = Deadline(self._longest_silence)
        self._without_angle = 0
        self._oriented = False
        self._subscribe(subscribe)
        qos = {"qos_overriding_options": overridable()}
        create = self.create_publisher
        self._command = create(Float64MultiArray, "motor/command", published(), **qos)
        self._torque = None
        if self._inputs.publish_torque:
            self._torque = create(Float64MultiArray, "motor/torque", published(), **qos)
        self.create_service(SetBool, "~/enable", self._on_enable)
        self._watch = MotorWatch(self._deadline, lambda: self._send(NO_VOLTAGE))
        self._tick_timer = wall_timer(self, PERIOD, self._tick)
        self._diagnostics = Diagnostics(self, self.report)
        if self._inputs.prepare_all:
            Thread(target=prepare, args=(self._chosen.current,), daemon=True).start()
        self.begin()

    def _subscribe(self, to_estimation: bool) -> None:
        if to_estimation:
            if self._inputs.input is TiltSource.IMU:
                listen(self, Imu, "imu/data", self._on_imu)
            else:
                listen(self, Float64, "tilt", self._on_tilt)
            listen(self, JointState, "joint_states", self._on_joints)
            # Not latched: filter_node repeats it, and another's publisher may not latch.
            self.create_subscription(
                Bool, "tilt/valid", lambda message: self.take_valid(message.data), subscribed()
            )
        stamped = self._inputs.use_stamped_vel
        self._velocities = self.create_subscription(
            TwistStamped if stamped else Twist,
            "cmd_vel",
            (lambda message: self._on_twist(message.twist)) if stamped else self._on_twist,
            subscribed(),
            qos_overriding_options=overridable(),
        )

    def set_up(self) -> None:
        """Begin afresh, with the motors cut."""
        self._stream = ControlStream(self._chosen.current)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cut the motors, and command nothing from then on."""
        self._cut_for_good()
        self._stream = ControlStream(self._chosen.current)
        return super().on_deactivate(state)

    def destroy_node(self) -> None:
        """Cut the motors, then destroy the node."""
        self._cut_for_good()
        self._watch.stop()
        super().destroy_node()

    def _longest_silence(self) -> float:
        """Return how long the motors may run without a tilt, by the steady clock [s]."""
        control, balance = self._chosen.current.control, self._chosen.current.balance
        simulated = self.get_clock().ros_time_is_active
        given = control.clock_timeout if simulated else 0.0
        return given or balance.settings.tilt_timeout

    def _cut_for_good(self) -> None:
        if self.is_active:
            self._publish(NO_VOLTAGE)
            self._command.wait_for_all_acked(STOP_TIMEOUT)

    def _configure(self, configuration: ControlConfiguration) -> None:
        self._stream.configure(configuration)

    def _on_imu(self, data: bytes) -> None:
        stamp, values = decode_imu(data)
        if not math.isfinite(sum(values[ORIENTATION:ORIENTATION_COVARIANCE])):
            self._stream.guard.skip(NOT_FINITE)
            return
        self._oriented = self._oriented or (has_angle(values) and not is_default(values))
        if not (self._oriented and has_angle(values)):
            self._without_angle += 1
            return
        self._take(stamp, float(tilt_of_quaternion(*values[:4])), values[GYRO + 1])

    def _on_tilt(self, data: bytes) -> None:
        self._take(self.clock_now(), decode_float64(data), None)

    def _take(self, stamp: int, tilt: float, rate: float | None) -> None:
        if not self.is_active:
            return
        self._arrival, self._arrived = self.clock_now(), time.monotonic()
        leaning = tilt - self._inputs.balance_tilt
        voltages = self._stream.add_tilt(stamp, leaning, rate, self._arrival)
        self._deadline.feed(self._arrived)
        if voltages is not None:
            self._publish(voltages)

    def _on_joints(self, data: bytes) -> None:
        reading = self._wheels.decode(data, self.clock_now())
        if reading is not None:
            self._stream.add_wheels(reading)

    def take_estimate(self, stamp: int, estimate: TiltEstimate, tilt: float) -> None:
        """Take what a filter in the same process publishes: stamp [ns], estimate, tilt [rad]."""
        if self._inputs.input is TiltSource.IMU:
            self._take(stamp, estimate.tilt, estimate.rate)
        else:
            self._take(self.clock_now(), tilt, None)

    def take_wheels(self, reading: WheelReading) -> None:
        """Take a reading of the wheel encoders."""
        self._stream.add_wheels(reading)

    def take_valid(self, valid: bool) -> None:
        """Take whether the tilt can be used."""
        self._stream.set_valid(valid)

    def _on_twist(self, twist: Twist) -> None:
        self._stream.command(self._now(), twist.linear.x, twist.angular.z)

    def _now(self) -> int:
        """Return what a tilt that came now would be stamped [ns], whatever clock stamps it."""
        last, now = self._stream.last_tilt, self.clock_now()
        if last is None:
            return now
        silent = time.monotonic() - self._arrived
        if self.get_clock().ros_time_is_active:  # which may stand still for a while
            late = silent > self._longest_silence()
            return last + (round(silent * 1e9) if late else max(now - self._arrival, 0))
        return last + round(silent * 1e9)

    def _publish(self, voltages: MotorVoltages) -> None:
        self._deadline.running = voltages != NO_VOLTAGE
        self._send(voltages)

    def _send(self, voltages: MotorVoltages) -> None:
        self._command.publish(encode_float64s(voltages))
        if self._torque is not None:
            self._torque.publish(encode_float64s(self._stream.torques(voltages)))

    def _tick(self) -> None:
        """Cut the motors when the tilt has fallen silent."""
        if self.is_active:
            voltages = self._stream.tick(self._now())
            if voltages is not None:
                self._publish(voltages)

    def _on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = True
        response.message = self._stream.enable() if request.data else self._stream.disable()
        self.get_logger().info(response.message)
        return response

    def report(self) -> Report:
        """Return what `/diagnostics` says."""
        stream, balance = self._stream, self._stream.balance
        values: dict[str, object] = {
            "controller": balance.settings.controller,
            ROBOT: stated(self._chosen.current.balance.robot),
            "unreadable_messages": self.unreadable,
            "messages_without_angle": self._without_angle,
            **stream.counts,
            "deadlines_missed": self._deadline.missed,
            **{f"tilt_{name}": count for name, count in stream.guard.counts.items()},
        }
        if balance.odometry is not None:
            values |= {
                "position_m": balance.odometry.position,
                "velocity_m_s": balance.odometry.velocity,
            }
        if not self.is_active:
            return self.idle_report(values)
        wheels = self._wheels.stamping.problem
        if problem := self._wrong_twist() or self._raw_imu() or wheels:
            return Report(Level.WARN, problem, values)
        if not stream.cut_because:
            return Report(Level.OK, f"balancing with {balance.settings.controller}", values)
        fine = balance.standing in (*UNINTERRUPTED, Standing.TILT_INVALID) or not stream.enabled
        level = Level.WARN if fine else Level.ERROR
        before = f"; before that: {stream.fell_because}" if stream.fell_because else ""
        return Report(level, f"motors cut: {stream.cut_because}{before}", values)

    def _wrong_twist(self) -> str:
        topic, stamped = self._velocities.topic_name, self._inputs.use_stamped_vel
        wrong = f"geometry_msgs/msg/{'Twist' if stamped else 'TwistStamped'}"
        kinds = {each.topic_type for each in self.get_publishers_info_by_topic(topic)}
        if wrong not in kinds:
            return ""
        return f"{topic} is published as {wrong}; set use_stamped_vel: {str(not stamped).lower()}"

    def _raw_imu(self) -> str:
        if not self._without_angle or self._stream.last_tilt is not None:
            return ""
        return "imu/data reports no orientation; let filter_node publish it"


def main(arguments: list[str] | None = None) -> int:
    """Run the node until it is asked to stop."""
    never_wait()
    return run(ControllerNode, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
