"""What a node that is managed says while it is not active."""

from __future__ import annotations

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.diagnostics import Level
from twbr_estimation.nodes.encoder_node import EncoderNode
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        (ControllerNode, {"prepare_all": False}),
        (Mpu6050Node, {"simulated": True}),
        (EncoderNode, {"simulated": True}),
    ],
)
def test_a_node_that_is_not_active_is_stale(graph: Any, kind: Any, parameters: Any) -> None:
    node = graph.add(kind(**graph.options(autostart=False, **parameters)))
    assert node.report()[:2] == (Level.STALE, "not configured")
    node.trigger_configure()
    assert node.report()[:2] == (Level.STALE, "inactive")
    node.trigger_activate()
    assert node.report().level is not Level.STALE
    node.trigger_deactivate()
    assert node.report()[:2] == (Level.STALE, "inactive")
    node.trigger_cleanup()
    assert node.report()[:2] == (Level.STALE, "not configured")


def test_a_device_that_cannot_be_opened_is_named(graph: Any) -> None:
    node = graph.add(EncoderNode(**graph.options(counters=["/nowhere/left", "/nowhere/right"])))
    level, message, _ = node.report()
    assert level is Level.STALE and "/nowhere/left" in message


def test_a_device_that_cannot_be_opened_is_logged_once(graph: Any, capfd: Any) -> None:
    reports = graph.collect(DiagnosticArray, "/diagnostics")
    graph.add(EncoderNode(**graph.options(counters=["/nowhere/left", "/nowhere/right"])))
    graph.spin_until(lambda: len(reports) >= 2)
    assert capfd.readouterr().err.count("/nowhere/left") == 1


def test_a_node_that_becomes_inactive_is_logged(graph: Any, capfd: Any) -> None:
    node = graph.add(EncoderNode(**graph.options(simulated=True)))
    node.trigger_deactivate()
    logged: list[str] = []

    def said() -> bool:
        logged.append(capfd.readouterr().err)
        return "[encoder_node]: inactive" in "".join(logged)

    graph.spin_until(said)
