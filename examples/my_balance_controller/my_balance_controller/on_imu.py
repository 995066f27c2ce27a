"""Balance on `imu/data` and `joint_states`: orientation, rate and stamp in one message."""

import math
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

RADIUS = 0.0375  # of a wheel [m]
POSITION, VELOCITY, TILT, RATE = 3.6, 18.8, 22.0, 2.7  # gains, in V per m, m/s, rad, rad/s
LIMIT, FALLEN, TIMEOUT, SMOOTHING = 12.0, 0.6, 0.1, 0.01  # V, rad, s, s


class BalanceOnImu(Node):
    """Full state feedback; position and speed hold the robot where it was stood up."""

    def __init__(self, **options):
        super().__init__("balance_on_imu", **options)
        self.time = self.position = self.velocity = self.start = 0.0
        self.wheel = None
        self.heard = self.get_clock().now()
        self.motors = self.create_publisher(Float64MultiArray, "motor/command", 10)
        self.create_subscription(JointState, "joint_states", self.on_wheels, 10)
        self.create_subscription(Imu, "imu/data", self.on_imu, 10)
        self.create_timer(0.05, self.watch)

    def on_wheels(self, message):
        wheels = [i for i, name in enumerate(message.name) if "wheel" in name]
        if wheels:
            self.wheel = sum(message.position[i] for i in wheels) / len(wheels)

    def on_imu(self, message):
        self.heard = self.get_clock().now()
        now = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        dt, self.time = now - self.time, now
        if self.wheel is None or dt <= 0.0:
            return
        q = message.orientation
        up_x, up_z = 2.0 * (q.x * q.z - q.w * q.y), 1.0 - 2.0 * (q.x * q.x + q.y * q.y)
        tilt, rate = math.atan2(-up_x, up_z), message.angular_velocity.y
        position = RADIUS * (self.wheel + tilt)  # the encoder turns with the body
        if abs(tilt) > FALLEN or dt > TIMEOUT:
            self.velocity, self.start = 0.0, position
        else:
            self.velocity += (
                dt / (SMOOTHING + dt) * ((position - self.position) / dt - self.velocity)
            )
        self.position = position
        moved = POSITION * (position - self.start) + VELOCITY * self.velocity
        self.drive(moved + TILT * tilt + RATE * rate if abs(tilt) <= FALLEN else 0.0)

    def watch(self):  # stop the motors when no orientation comes any more
        if (self.get_clock().now() - self.heard).nanoseconds * 1e-9 > TIMEOUT:
            self.drive(0.0)

    def drive(self, voltage):
        voltage = min(max(voltage, -LIMIT), LIMIT)
        if self.context.ok():  # after Ctrl-C nothing can be published
            self.motors.publish(Float64MultiArray(data=[voltage, voltage]))


def main():
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(BalanceOnImu())
