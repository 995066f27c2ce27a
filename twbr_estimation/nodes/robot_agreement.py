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
from functools import lru_cache
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from ..robot import Robot
from ..streams.messages import diagnostic_values
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


_DEFAULT = _values(Robot())


@lru_cache(maxsize=4)
def stated(robot: Robot) -> str:
    """Return the fields of a robot that differ from the defaults, as JSON."""
    differing = {name: v for name, v in _values(robot).items() if v != _DEFAULT[name]}
    return json.dumps(differing)


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
        self._others: dict[str, tuple[float, str, str]] = {}
        listen(node, DiagnosticArray, "/diagnostics", self._take)

    def _take(self, data: bytes) -> None:
        if _ROBOT_MARK not in data and _CHIP_MARK not in data:  # spares the decoding of most
            return
        for status, key, value in diagnostic_values(data, (ROBOT, CHIP)):
            space, _, name = status.rpartition("/")
            if space == self._space and status != self._own.lstrip("/"):
                self.note(name, key, value, time.monotonic())

    def note(self, node: str, key: str, text: str, now: float) -> None:
        """Take what a node states at `now` [s]; what is no JSON of a robot is left out."""
        room = node in self._others or len(self._others) < MOST_NODES
        if room and _read(key, text) is not None:
            self._others[node] = now, key, text

    def problem(self, now: float) -> str:
        """Return which nodes have another robot, in one sentence; empty where all agree."""
        robot, found = self._robot(), []
        self._others = {
            node: each for node, each in self._others.items() if now - each[0] < FORGOTTEN
        }
        for node, (_, key, text) in sorted(self._others.items()):
            if names := _differing(robot, key, text):
                found.append(f"{names} of {node}")
        if not found:
            return ""
        return f"not as here: {'; '.join(found)}; give all nodes the same robot.yaml"


# The same is stated every second: it is read and compared once.
@lru_cache(maxsize=4 * MOST_NODES)
def _read(key: str, text: str) -> Values | None:
    """Return the values that a node states; None where it is no JSON of a robot."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    return _DEFAULT | found if key == ROBOT else found


@lru_cache(maxsize=4 * MOST_NODES)
def _differing(robot: Robot, key: str, text: str) -> str:
    """Return the parameters in which a robot is another one than a node states."""
    own, other = _values(robot), _read(key, text) or {}
    return ", ".join(f"robot.{name}" for name in own if _differs(own, other, name))


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
