"""Whether the nodes of a robot are configured for the same robot.

Each node that has `robot.*` states in its `/diagnostics` what of it differs from the defaults;
`mpu6050_node` states the ranges of its chip. `filter_node` compares them with its own.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from ..robot import Robot
from .qos import listen

ROBOT, CHIP = "robot", "chip"
"""Names of the values in `/diagnostics`: `robot.*` apart from defaults, and the chip's ranges."""
FORGOTTEN = 5.0
"""Time after which the statement of a node that has ended is forgotten [s]."""
MOST_NODES = 16
"""Nodes that are compared; more statements are left out."""
TOLERANCE = 0.01
"""Relative difference between two numbers that is taken for rounding."""
OF_ONE_NODE = "mounting"
"""Used by the one node that corrects, which may take it from the frames."""

_ROBOT_MARK, _CHIP_MARK = (f"{key}\0".encode() for key in (ROBOT, CHIP))  # as serialised

Values = dict[str, Any]


def _values(robot: Robot) -> Values:
    return {each.name: getattr(robot, each.name) for each in fields(robot)}


def stated(robot: Robot) -> str:
    """Return the fields of a robot that differ from the defaults, as JSON."""
    default = _values(Robot())
    return json.dumps({name: v for name, v in _values(robot).items() if v != default[name]})


def stated_ranges(gyro_range: float, accel_range: float) -> str:
    """Return the full scales a chip is set to, [rad/s] and [m/s^2], as JSON."""
    return json.dumps({"gyro_range": gyro_range, "accel_range": accel_range})


class RobotAgreement:
    """Compares what other nodes state with the robot of this one."""

    def __init__(self, node: Node, robot: Callable[[], Robot]) -> None:
        """Listen.

        Args:
            node: The node.
            robot: Returns the robot in force.
        """
        self._robot = robot
        self._own = node.get_fully_qualified_name()
        self._space = self._own.rpartition("/")[0].lstrip("/")
        self._others: dict[str, tuple[float, Values]] = {}
        listen(node, DiagnosticArray, "/diagnostics", self._take)

    def _take(self, data: bytes) -> None:
        if _ROBOT_MARK not in data and _CHIP_MARK not in data:  # spares the decoding of most
            return
        for status in deserialize_message(data, DiagnosticArray).status:
            space, _, name = status.name.rpartition("/")
            if space != self._space or status.name == self._own.lstrip("/"):
                continue
            for value in status.values:
                if value.key in (ROBOT, CHIP):
                    self.note(name, value.key, value.value, time.monotonic())

    def note(self, node: str, key: str, text: str, now: float) -> None:
        """Take what a node states at `now` [s]; what is no JSON of a robot is left out."""
        try:
            found = json.loads(text)
        except (ValueError, RecursionError):
            return
        full = node in self._others or len(self._others) < MOST_NODES
        if isinstance(found, dict) and full:
            values = _values(Robot()) | found if key == ROBOT else found
            self._others[node] = now, values

    def problem(self, now: float) -> str:
        """Return which nodes have another robot, in one sentence; empty where all agree."""
        own, found = _values(self._robot()), []
        self._others = {
            node: each for node, each in self._others.items() if now - each[0] < FORGOTTEN
        }
        for node, (_, values) in sorted(self._others.items()):
            names = [f"robot.{name}" for name in own if _differs(own, values, name)]
            if names:
                found.append(f"{', '.join(names)} of {node}")
        if not found:
            return ""
        return f"not as here: {'; '.join(found)}; give all nodes the same robot.yaml"


def _differs(own: Values, other: Values, name: str) -> bool:
    if name == OF_ONE_NODE or name not in other:
        return False
    one, two = own[name], other[name]
    if isinstance(one, tuple) and isinstance(two, (tuple, list)) and len(one) == len(two):
        return not all(map(_close, one, two))
    return not _close(one, two)


def _close(one: Any, two: Any) -> bool:
    numbers = isinstance(one, (int, float)) and isinstance(two, (int, float))
    return math.isclose(one, two, rel_tol=TOLERANCE) if numbers else bool(one == two)
