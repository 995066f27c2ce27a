"""Nodes of a balancing robot are stopped and killed: the motors stop, and it balances again."""

from __future__ import annotations

import signal
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

from reliability.live_robot import PARAMETERS, live_robot

PERIOD, TIMEOUT = 0.01, 0.4
"""Of the controller, and its `tilt_timeout` [s]: long, so that a loaded machine cuts no motors."""
SLOW = {
    **PARAMETERS,
    "simulator_node": {**PARAMETERS["simulator_node"], "imu_period": PERIOD},
    "controller_node": {
        **PARAMETERS["controller_node"],
        "period": PERIOD,
        "tilt_timeout": TIMEOUT,
        "wheel_timeout": TIMEOUT,
    },
}
MOST = round(TIMEOUT / PERIOD) + 1
"""Commands in `tilt_timeout` and one `period` after the last tilt."""
STEADY = 15
"""Commands in a row that drive; more than a robot needs that falls on a loaded machine."""


def test_a_node_upstream_that_hangs_or_is_killed_stops_the_motors(graph: Any) -> None:
    with live_robot(graph, SLOW, STEADY) as robot:
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
