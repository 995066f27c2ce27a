"""Overrides of quality of service stay with their topic."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from std_msgs.msg import Float64

from twbr_estimation.nodes.qos import DEPTH, overridable, published


def test_an_override_changes_its_own_topic_only(graph: Any) -> None:
    command = ["--ros-args", "-p", "qos_overrides./first.publisher.depth:=7"]
    node = graph.add(Node("subject", cli_args=command, **graph.options()))
    depths = [
        node.create_publisher(
            Float64, topic, published(), qos_overriding_options=overridable()
        ).qos_profile.depth
        for topic in ("first", "second")
    ]
    assert depths == [7, DEPTH]
