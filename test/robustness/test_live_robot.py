"""Nodes of a balancing robot are stopped and killed: the motors stop, and it balances again."""

from __future__ import annotations

import signal
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

from reliability.live_robot import live_robot

MOST = 11
"""Commands in `tilt_timeout` and one `period`, 0.05 s and 0.005 s, after the last tilt."""


def test_a_node_upstream_that_hangs_or_is_killed_stops_the_motors(graph: Any) -> None:
    with live_robot(graph) as robot:
        for node, number in (
            ("filter_node", signal.SIGSTOP),
            ("correction_node", signal.SIGKILL),
            ("simulator_node", signal.SIGSTOP),
        ):
            seen = robot.silenced(node, number)
            assert seen.driving <= MOST, f"{node}, {number.name}: {seen}"
            assert seen.zeros > 0, f"{node}, {number.name}: {seen}"
            early, _ = robot.recovered(node, number)
            assert early == 0, f"{node}, {number.name}: driven before it was stood up"
