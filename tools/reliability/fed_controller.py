"""A controller fed by hand, and an independent client that counts its commands."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Bool, Float64MultiArray

from twbr_estimation.ros_messages import set_stamp, set_tilt

PERIOD = 0.005
"""Time between two tilts [s]."""
UPRIGHT = 0.05
"""A tilt at which a robot is stood up [rad]."""


class FedController:
    """Feeds a controller with a lean that trembles, and notes what comes back and when."""

    def __init__(self, graph: Any, simulated_time: bool = False) -> None:
        """Publish on the topics of `controller_node`.

        Args:
            graph: Has a `probe` to publish with and an `executor` to spin.
            simulated_time: Whether to publish `/clock` and to stamp by it.
        """
        self.graph, self.count = graph, 0
        """`count`: tilts that were fed."""
        self.commands: list[tuple[float, tuple[float, ...], int]] = []
        """When a command came [s], what it was [V], and how many tilts had been fed before."""
        create = graph.probe.create_publisher
        self._imu = create(Imu, "imu/data", 10)
        self._joints = create(JointState, "joint_states", 10)
        self.valid = create(Bool, "tilt/valid", 10)
        self._clock = create(Clock, "/clock", 10) if simulated_time else None
        graph.probe.create_subscription(Float64MultiArray, "motor/command", self._on_command, 1000)

    def _on_command(self, message: Float64MultiArray) -> None:
        self.commands.append((time.monotonic(), tuple(message.data), self.count))

    def feed(
        self,
        age: float = 0.0,
        frozen: bool = False,
        lean: float = UPRIGHT,
        wheels: bool = True,
    ) -> None:
        """Publish a tilt and the wheels, then wait for a period.

        Args:
            age: Of their stamps [s].
            frozen: Whether the tilt stays the same; otherwise it trembles.
            lean: The tilt [rad].
            wheels: Whether to publish the wheels.
        """
        self.count += 1
        stamp = self.graph.probe.get_clock().now().nanoseconds - round(age * 1e9)
        imu, joints = Imu(), JointState(name=["left_wheel_joint"], position=[0.0])
        set_stamp(imu, stamp)
        set_stamp(joints, stamp)
        set_tilt(imu.orientation, lean + (0.0 if frozen else 1e-5 * (self.count % 2)))
        imu.orientation_covariance[0] = 1e-4
        if self._clock is not None:
            self._clock.publish(Clock(clock=imu.header.stamp))
        if wheels:
            self._joints.publish(joints)
        self._imu.publish(imu)
        self.wait(PERIOD)

    def wait(self, seconds: float) -> None:
        """Feed nothing for this long, but take what comes."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.graph.executor.spin_once(timeout_sec=PERIOD)

    def until(self, condition: Callable[[], bool], limit: float = 20.0, **how: Any) -> None:
        """Feed until the condition holds.

        Raises:
            TimeoutError: it does not within `limit` [s].
        """
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"condition not met within {limit:g} s")
            self.feed(**how)

    def drives(self) -> bool:
        """Return whether the latest command drives a motor."""
        return bool(self.commands) and any(self.commands[-1][1])

    def driving(self, first: int) -> int:
        """Return how many commands from that number on drive a motor."""
        return sum(any(each) for _, each, _ in self.commands[first:])

    def since(self, start: float) -> list[tuple[float, ...]]:
        """Return the commands since a time."""
        return [command for at, command, _ in self.commands if at >= start]
