"""All nodes of this package in one process, and what drives them besides messages."""

from __future__ import annotations

import json
import os
import pty
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from reliability.graph import Graph, Wiretap
from twbr_estimation.nodes.check_node import CheckNode
from twbr_estimation.nodes.controller_node import ControllerNode
from twbr_estimation.nodes.correction_node import CorrectionNode
from twbr_estimation.nodes.dashboard_node import DashboardNode
from twbr_estimation.nodes.encoder_node import EncoderNode
from twbr_estimation.nodes.estimation_node import compose
from twbr_estimation.nodes.evaluator_node import EvaluatorNode
from twbr_estimation.nodes.filter_node import FilterNode
from twbr_estimation.nodes.mpu6050_node import Mpu6050Node
from twbr_estimation.nodes.replay_node import ReplayNode
from twbr_estimation.nodes.serial_node import SerialNode
from twbr_estimation.nodes.simulator_node import SimulatorNode

RECORDING = Path(__file__).resolve().parents[2] / "bags" / "training"
ESTIMATION = "estimation_node"
"""Namespace of the nodes in one process, whose names are those of the separate ones."""


def subscribers(graph: Graph, simulated_time: bool = False) -> list[Any]:
    """Return every node that subscribes to anything, one a kind.

    Args:
        graph: Where they are added.
        simulated_time: Whether they follow `/clock`.
    """
    time = {"use_sim_time": True} if simulated_time else {}
    compared = {"filter": "complementary", "compare": ["all"], "predict": True}
    made = [
        CorrectionNode(**graph.options(**time)),
        FilterNode(**graph.options(**compared, **time)),
        ControllerNode(**graph.options(prepare_all=False, **time)),
        EvaluatorNode(**graph.options(table=False, **time)),
        SimulatorNode(**graph.options()),
        CheckNode(at_end=lambda: None, **graph.options(**time)),
        DashboardNode(**graph.options(**time)),
        ReplayNode(**graph.options(bag=str(RECORDING), rate=0.0, wait_for=["never"], **time)),
        *in_one_process(graph, **time),
    ]
    return [graph.add(node) for node in made]


def in_one_process(graph: Graph, **parameters: Any) -> list[Any]:
    """Return estimation_node with correction, filter and controller, not yet added."""
    options = graph.options(drivers=False, control=True, prepare_all=False, **parameters)
    return compose(namespace=ESTIMATION, **options)


def drivers(graph: Graph, port: Path) -> list[Any]:
    """Return the nodes that read a device, simulated where it can be; they do not start.

    Args:
        graph: Where they are added.
        port: What serial_node would open.
    """
    made = [
        Mpu6050Node(**graph.options(simulated=True, autostart=False)),
        EncoderNode(**graph.options(simulated=True, autostart=False)),
        SerialNode(**graph.options(port=str(port), format="frames", autostart=False)),
    ]
    return [graph.add(node) for node in made]


@contextmanager
def serial_line() -> Iterator[tuple[int, Path]]:
    """Yield a descriptor to write to, and the path of the port where that is read."""
    device, computer = pty.openpty()
    tty.setraw(computer)
    try:
        yield device, Path(os.ttyname(computer))
    finally:
        os.close(device)
        os.close(computer)


def tapped(nodes: list[Any]) -> Wiretap:
    """Return a wiretap on all their subscriptions, those that the page samples included."""
    wire = Wiretap(*nodes)
    for node in nodes:
        for robot in getattr(node, "robots", ()):
            robot.open()
            robot.want(robot.on_request)
            for topic in robot._topics:
                wire.listen(topic.name, topic.accept, raw=True)
    return wire


def tick(nodes: list[Any], wire: Wiretap) -> None:
    """Call what timers and browsers call: looks, reports, figures, pictures.

    Args:
        nodes: Which there are.
        wire: Counts what a picture raises, as JSON of numbers that are not finite does.
    """
    for node in nodes:
        for name in ("_tick", "look", "publish_figures"):
            if hasattr(node, name):
                getattr(node, name)()
        for robot in getattr(node, "robots", ()):
            wire.guarded("the page", lambda: picture(robot))  # noqa: B023
        if hasattr(node, "_diagnostics"):
            node._diagnostics.update()


def picture(robot: Any) -> None:
    """Make what a browser gets.

    Raises:
        ValueError: a number in it is not finite.
    """
    sums = [each.row(name) for name, each in robot.telemetry.sums.items()]
    json.dumps([robot.telemetry.frame(), sums], allow_nan=False)
    robot.statuses(), robot.words(), robot.rates()
