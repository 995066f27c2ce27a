"""Controllers as other projects write them: their topics, their joints, nothing of ours."""

from __future__ import annotations

import math
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, Float64MultiArray

RADIUS = 0.0375


class TorqueOnPitch(Node):
    """Pitch and wheel speeds in, torques out, on a timer of 100 Hz; all topics absolute.

    In the manner of anss0907/Self_Balancing_Robot_With_ROS2_using_LQR_Controller ("GRACE").
    Gains [N m]: an LQR on the rig with motors that give the torque they are told.
    """

    GAINS = (-0.96, -0.115, -0.045, -0.11)  # pitch, its rate, position, speed

    def __init__(self, **options: Any) -> None:
        super().__init__("lqr_balancing_controller", **options)
        self.pitch: float | None = None
        self.before = self.rate = self.way = 0.0
        self.speeds: tuple[float, float] | None = None
        self.last: Any = None
        self.create_subscription(Float64, "/robot_pitch", self.on_pitch, 10)
        self.create_subscription(JointState, "/joint_states", self.on_joints, 10)
        self.out = self.create_publisher(
            Float64MultiArray, "/simple_effort_controller/commands", 10
        )
        self.create_timer(0.01, self.control)

    def on_pitch(self, message: Float64) -> None:
        self.pitch = message.data

    def on_joints(self, message: JointState) -> None:
        left = message.name.index("wheel_left_joint")
        right = message.name.index("wheel_right_joint")
        self.speeds = (message.velocity[left], message.velocity[right])

    def control(self) -> None:
        if self.pitch is None or self.speeds is None:
            return
        now = self.get_clock().now()
        last, self.last = self.last, now
        if last is None:
            self.before = self.pitch
            return
        dt = (now - last).nanoseconds / 1e9
        if dt <= 0.0:
            return
        raw = (self.pitch - self.before) / dt
        self.rate, self.before = 0.3 * self.rate + 0.7 * raw, self.pitch
        speed = RADIUS * sum(self.speeds) / 2.0
        self.way += speed * dt
        state = (self.pitch, self.rate, self.way, speed)
        torque = -sum(gain * value for gain, value in zip(self.GAINS, state, strict=True))
        if abs(self.pitch) > math.radians(35.0):
            torque = 0.0
        self.out.publish(Float64MultiArray(data=[torque / 2.0, torque / 2.0]))


class PidOnImu(Node):
    """Orientation in, one wheel effort out: pitch from the quaternion, time from the stamps.

    In the manner of the balance bots that read `/imu`: no wheels, so it drifts.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("balance_controller", **options)
        self.last: float | None = None
        self.before = self.total = 0.0
        self.create_subscription(Imu, "/imu", self.on_imu, 10)
        self.out = self.create_publisher(Float64MultiArray, "/wheel_volts", 10)

    def on_imu(self, message: Imu) -> None:
        q = message.orientation
        pitch = math.asin(max(-1.0, min(1.0, 2.0 * (q.w * q.y - q.z * q.x))))
        stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        last, self.last = self.last, stamp
        if last is None or stamp <= last:
            return
        dt = stamp - last
        rate, self.before = (pitch - self.before) / dt, pitch
        self.total += pitch * dt
        volts = 60.0 * pitch + 200.0 * self.total + 1.5 * rate
        self.out.publish(Float64MultiArray(data=[max(-12.0, min(12.0, volts))] * 2))
