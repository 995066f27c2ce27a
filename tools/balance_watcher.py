"""What `make balance` receives of the graph of the robot, and the commands of its keys."""

from __future__ import annotations

import math
import time
from typing import Any

from balance_view import Shown

from twbr_estimation.controllers import listed_controllers
from twbr_estimation.filters import listed_filters
from twbr_estimation.robot import Robot

PUSH = 3.0
"""Force of one key [N]."""
FASTER = 0.1
"""Change of the commanded speed with one key [m/s]."""
FASTEST = 0.4
"""[m/s]."""


class Watcher:
    """Subscribes to the graph, and sends the commands of the keys."""

    def __init__(self, shown: Shown) -> None:
        """Join the graph; `shown` is kept up to date."""
        import rclpy
        from geometry_msgs.msg import TwistStamped
        from rclpy.parameter_client import AsyncParameterClient
        from sensor_msgs.msg import Imu, JointState
        from std_msgs.msg import Float64, Float64MultiArray
        from std_srvs.srv import Trigger

        rclpy.init()
        self._rclpy, self._twist, self._trigger = rclpy, TwistStamped, Trigger
        self._shown = shown
        self._node = node = rclpy.create_node("balance_view")
        from twbr_estimation.nodes.spin import make_executor

        self._executor = make_executor()
        self._executor.add_node(node)
        listen = node.create_subscription
        listen(JointState, "reference/joint_states", self._on_reference, 10)
        listen(JointState, "joint_states", self._on_wheels, 10)
        listen(Imu, "imu/data", self._on_imu, 10)
        listen(Float64MultiArray, "motor/command", self._on_command, 10)
        listen(Float64, "evaluator_node/active/mse_deg2", self._on_mse, 10)
        self._listen_to_diagnostics()
        self._push = node.create_client(Trigger, "simulator_node/push")
        self._drive = node.create_publisher(TwistStamped, "cmd_vel", 10)
        self._reset = node.create_client(Trigger, "evaluator_node/reset")
        self._parameters = {
            name: AsyncParameterClient(node, f"{name}_node")
            for name in ("filter", "controller", "simulator")
        }
        self._last_wheel: tuple[float, float] | None = None

    def _listen_to_diagnostics(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        def take(message: DiagnosticArray) -> None:
            for status in message.status:
                if status.name == "controller_node":
                    balancing = status.message.startswith("balancing")
                    self._shown.standing = "balancing" if balancing else status.message
                    if not self._can_be_asked():
                        self._shown.standing = "waiting for the nodes' services"

        self._node.create_subscription(DiagnosticArray, "/diagnostics", take, 10)

    def _can_be_asked(self) -> bool:
        """Return whether a key would reach its node: a request before that is lost."""
        asked = (self._push, self._reset)
        return all(each.service_is_ready() for each in asked) and all(
            each.services_are_ready() for each in self._parameters.values()
        )

    def _on_reference(self, message: Any) -> None:
        self._shown.reference = math.degrees(message.position[0])

    def _on_wheels(self, message: Any) -> None:
        now = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
        turned = sum(message.position) / len(message.position)
        tilt = math.radians(self._shown.reference)
        way = Robot().wheel_radius * (turned + (0.0 if math.isnan(tilt) else tilt))
        last, self._last_wheel = self._last_wheel, (now, way)
        if last is not None and now > last[0]:
            speed, before = (way - last[1]) / (now - last[0]), self._shown.speed
            self._shown.speed = speed if math.isnan(before) else before + 0.05 * (speed - before)

    def _on_imu(self, message: Any) -> None:
        q = message.orientation
        self._shown.estimate = math.degrees(2.0 * math.atan2(q.y, q.w))

    def _on_command(self, message: Any) -> None:
        self._shown.voltage = sum(message.data) / len(message.data)

    def _on_mse(self, message: Any) -> None:
        self._shown.mse = message.data

    def spin(self, seconds: float) -> None:
        """Let messages in for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def repeat_command(self) -> None:
        """Send the commanded speed again, as a joystick would."""
        message = self._twist()
        message.twist.linear.x = self._shown.target
        self._drive.publish(message)

    def act(self, key: str) -> None:
        """Do what a key means."""
        shown = self._shown
        if key in "ad":
            self._pushed(PUSH if key == "d" else -PUSH)
        elif key in "ws ":
            step = {"w": FASTER, "s": -FASTER, " ": -shown.target}[key]
            shown.target = min(max(shown.target + step, -FASTEST), FASTEST)
            shown.message = f"driving at {shown.target:+.1f} m/s"
        elif key in "fF":
            self._switch("filter", next_of(listed_filters(), shown.filter, key == "F"))
        elif key in "cC":
            self._switch("controller", next_of(listed_controllers(), shown.controller, key == "C"))

    def _pushed(self, force: float) -> None:
        from rclpy.parameter import Parameter

        change = [Parameter("push_force", value=force)]
        done = self._parameters["simulator"].set_parameters(change)
        done.add_done_callback(lambda _: self._push.call_async(self._trigger.Request()))
        self._shown.message = f"pushed by {force:+g} N"

    def _switch(self, what: str, name: str) -> None:
        from rclpy.parameter import Parameter

        future = self._parameters[what].set_parameters([Parameter(what, value=name)])
        self._shown.message = f"switching to {name} ..."

        def answered(done: Any) -> None:
            (result,) = done.result().results
            if not result.successful:
                self._shown.message = f"{name}: {result.reason}"
                setattr(self._shown, what, name)  # so that the next key goes past it
                return
            setattr(self._shown, what, name)
            self._shown.message = f"{what} {name}"
            if what == "filter":
                self._reset.call_async(self._trigger.Request())
                self._shown.mse = math.nan

        future.add_done_callback(answered)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._rclpy.try_shutdown()


def next_of(names: Any, current: str, backwards: bool) -> str:
    """Return the name after the current one, or before it, around the end."""
    found = list(names)
    at = found.index(current) if current in found else -1
    return str(found[(at + (-1 if backwards else 1)) % len(found)])
