"""A simulated robot on the topics of a real one, in real time; a process of `tools/balance.py`.

Publishes `imu/data_raw`, `joint_states` and `reference/joint_states`, follows `motor/command`, and
is pushed by a force [N] on `push`. Somebody stands it up when it has fallen.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, Float64MultiArray

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from twbr_estimation.messages import set_stamp
from twbr_estimation.nodes.spin import run
from twbr_estimation.simulation.stepping import Reading, SimulatedRobot

PERIOD = 0.005
"""Of sensors and motors [s]."""
DRAWN = 20.0
"""Length of the disturbances that are drawn [s]; they come again and again."""
BEHIND = 0.1
"""A robot further behind the clock than this [s] lets time go."""
SILENT = 0.1
"""Without a command for so long [s] the motor driver stops by itself."""


class SimulatedRobotNode(Node):
    """Moves the robot up to now, and publishes what its sensors read."""

    def __init__(self, **options: Any) -> None:
        """Stand the robot upright."""
        super().__init__("simulated_robot", **options)
        world = self.declare_parameter("world", "paper").value
        seed = self.declare_parameter("seed", 1).value
        disturbed = self.declare_parameter("disturbed", False).value
        self._robot = SimulatedRobot(world, seed, PERIOD, duration=DRAWN, disturbed=disturbed)
        create = self.create_publisher
        self._imu, self._wheels = (
            create(Imu, "imu/data_raw", 10),
            create(JointState, "joint_states", 10),
        )
        self._reference = create(JointState, "reference/joint_states", 10)
        self.create_subscription(Float64MultiArray, "motor/command", self._on_command, 10)
        self.create_subscription(Float64, "push", lambda force: self._robot.push(force.data), 10)
        self._voltages, self._told = (0.0, 0.0), 0.0
        self._stamp_offset = time.time_ns() - self._robot.stamp
        self._begin = time.monotonic() - self._robot.time
        self.create_timer(PERIOD, self._move)

    def _on_command(self, command: Float64MultiArray) -> None:
        self._voltages, self._told = (command.data[0], command.data[-1]), time.monotonic()

    def _move(self) -> None:
        now = time.monotonic()
        self._begin = max(self._begin, now - BEHIND - self._robot.time)
        silent = now - self._told > SILENT
        while now - self._begin >= self._robot.time + PERIOD:
            voltages = (0.0, 0.0) if silent else self._voltages
            for reading in self._robot.advance(voltages, PERIOD):
                self._publish(reading)

    def _publish(self, reading: Reading) -> None:
        stamp = reading.stamp + self._stamp_offset
        wheels = reading.wheels
        names = ["wheel_joint"] if len(wheels) == 1 else ["left_wheel_joint", "right_wheel_joint"]
        for publisher, joints, angles in (
            (self._wheels, names, wheels),
            (self._reference, ["tilt"], (reading.reference,)),
        ):
            state = JointState(name=joints, position=angles)
            set_stamp(state, stamp)
            publisher.publish(state)
        imu = Imu()
        set_stamp(imu, stamp)
        imu.orientation_covariance[0] = -1.0
        rate, force = imu.angular_velocity, imu.linear_acceleration
        rate.x, rate.y, rate.z, force.x, force.y, force.z = reading.imu
        self._imu.publish(imu)


def main(arguments: list[str] | None = None) -> int:
    """Run the robot until it is asked to stop."""
    return run(SimulatedRobotNode, arguments)


if __name__ == "__main__":
    sys.exit(main())
