"""An evaluator keeps the last minute, whatever came before."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

from reliability.graph import resident_megabytes
from reliability.parts.evaluator import COMPARED, FIRST_STAMP, REFERENCE

from twbr_estimation.nodes.evaluator_node import EvaluatorNode
from twbr_estimation.nodes.memory import give_back
from twbr_estimation.scoring.live import HISTORY
from twbr_estimation.streams.messages import JointStateEncoder

RATE = 50
MINUTES = 6
GROWTH = 2.0
"""[MB]"""


def test_its_memory_is_that_of_its_history(graph: Any) -> None:
    node = graph.add(EvaluatorNode(**graph.options(table=False, estimators=[""])))
    callbacks = {each.topic_name: each.callback for each in node.subscriptions}
    names = tuple(f"estimator_{index}" for index in range(4))
    reference, compared = JointStateEncoder(("tilt",)), JointStateEncoder(names)
    memory = []
    for index in range(MINUTES * 60 * RATE):
        stamp = FIRST_STAMP + index * 10**9 // RATE
        callbacks[f"/{REFERENCE}"](reference.encode(stamp, [0.1], [0.0]))
        callbacks[f"/{COMPARED}"](compared.encode(stamp, [0.1] * 4, [0.0] * 4))
        if index % RATE == 0:
            node.publish_figures()
        if index % (60 * RATE) == 0:
            give_back()
            memory.append(resident_megabytes())
    assert not node.callback_errors.counts and node._received == 2 * MINUTES * 60 * RATE
    kept = node._live._reference.stamps
    assert kept.size <= HISTORY * RATE + RATE + 1 and not node._live._reference._fresh[RATE:]
    assert memory[-1] - memory[2] < GROWTH, memory
