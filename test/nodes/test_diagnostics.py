"""The small diagnostics publisher."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from twbr_estimation.nodes.diagnostics import Diagnostics, Level, Report


def test_a_report_reaches_the_diagnostics_topic(graph: Any) -> None:
    node = graph.add(Node("subject", namespace="/robot", **graph.options()))
    received = graph.collect(DiagnosticArray, "/diagnostics")
    Diagnostics(
        node,
        lambda: Report(Level.WARN, "late", {"late_samples": 3, "rate_hz": 499.99999}),
        hardware_id="/dev/i2c-1",
        period=0.05,
    )
    graph.spin_until(lambda: len(received) >= 2)
    (status,) = received[0].status
    assert status.name == "robot/subject"
    assert status.level == Level.WARN.value
    assert status.hardware_id == "/dev/i2c-1"
    assert {each.key: each.value for each in status.values} == {
        "late_samples": "3",
        "rate_hz": "500",
    }
