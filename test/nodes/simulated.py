"""A simulated robot on the topics of a test's graph, in lockstep with its commands."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from twbr_estimation.ros_messages import set_stamp, set_tilt
from twbr_estimation.simulation.simulated_robot import SensorReading, SimulatedRobot

DEPTH = 1000


class SimulatedTopics:
    """Publishes what the robot's sensors read, and moves it by the commands."""

    def __init__(
        self,
        graph: Any,
        robot: SimulatedRobot,
        *,
        perfect: bool = False,
        joints: tuple[str, ...] = ("wheel_joint",),
        command: str = "motor/command",
        voltages: Callable[[tuple[float, ...], SensorReading], tuple[float, ...]] | None = None,
    ) -> None:
        """Create publishers and the subscription.

        Args:
            graph: The test's graph.
            robot: Reads its sensors once a `period`.
            perfect: Whether `imu/data` with the true tilt goes out, too.
            joints: Names in `joint_states`; two names for a robot with one encoder repeat it.
            command: Topic of the motors' commands.
            voltages: Turns a command into volts, for commands of another unit.
        """
        self.graph, self.robot, self._perfect, self._joints = graph, robot, perfect, joints
        self._voltages = voltages or (lambda values, _: values)
        self._last = robot.reading
        create = graph.probe.create_publisher
        self._clock = create(Clock, "/clock", DEPTH)
        self._raw = create(Imu, "imu/data_raw", DEPTH)
        self._imu = create(Imu, "imu/data", DEPTH) if perfect else None
        self._states = create(JointState, "joint_states", DEPTH)
        self.commands: list[tuple[float, ...]] = []
        """Every command that came."""
        graph.probe.create_subscription(
            Float64MultiArray, command, lambda each: self.commands.append(tuple(each.data)), DEPTH
        )

    def publish(self, reading: SensorReading) -> None:
        """Publish one reading under its stamp; the wheels first, so that they are known."""
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = divmod(reading.stamp, 10**9)
        self._clock.publish(clock)
        wheels = [reading.wheels[min(i, len(reading.wheels) - 1)] for i in range(len(self._joints))]
        states = JointState(name=list(self._joints), position=wheels, velocity=self._rates(reading))
        set_stamp(states, reading.stamp)
        self._states.publish(states)
        raw = Imu()
        set_stamp(raw, reading.stamp)
        raw.orientation_covariance[0] = -1.0
        rate, force = raw.angular_velocity, raw.linear_acceleration
        rate.x, rate.y, rate.z, force.x, force.y, force.z = reading.imu
        self._raw.publish(raw)
        if self._imu is not None:
            perfect = Imu()
            set_stamp(perfect, reading.stamp)
            set_tilt(perfect.orientation, reading.truth.tilt)
            perfect.angular_velocity.y = reading.truth.rate
            self._imu.publish(perfect)

    def _rates(self, reading: SensorReading) -> list[float]:
        last, self._last = self._last, reading
        dt = (reading.stamp - last.stamp) * 1e-9
        mean = (reading.wheels[0] - last.wheels[0]) / dt if dt > 0.0 else 0.0
        return [mean] * len(self._joints)

    def run(self, seconds: float, period: float = 0.005, wait: bool = True) -> list[float]:
        """Move on, one command a period; return the true tilts [rad].

        Args:
            seconds: How long.
            period: Of the commands [s]; a multiple of the robot's own.
            wait: Whether each period's command is waited for.
        """
        tilts = []
        for _ in range(round(seconds / period)):
            last = self.commands[-1] if self.commands else (0.0, 0.0)
            left, right = self._voltages(last, self.robot.reading)
            count = len(self.commands)
            for reading in self.robot.advance((left, right), period):
                self.publish(reading)
                tilts.append(reading.truth.tilt)
            if wait:
                self.graph.spin_until(lambda count=count: len(self.commands) > count)
            else:
                self.graph.executor.spin_once(timeout_sec=0.0)
        return tilts


def upright(tilts: list[float], limit: float = 0.5) -> bool:
    """Whether the robot never leaned further than `limit` [rad]."""
    return all(math.isfinite(tilt) and abs(tilt) < limit for tilt in tilts)
