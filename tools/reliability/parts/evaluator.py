"""Memory of an evaluator.

It compares eight estimators with a reference at 500 Hz, through the middleware but faster than in
real time. What it keeps is the last minute; its memory may not grow beyond that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from sensor_msgs.msg import JointState

from reliability.graph import Graph, callback_errors, opened_graph, resident_megabytes
from reliability.row import Effort, Row
from twbr_estimation.nodes.evaluator_node import EvaluatorNode
from twbr_estimation.nodes.memory import give_back
from twbr_estimation.streams.messages import JointStateEncoder

MESSAGES, ESTIMATORS, RATE = 400_000, 8, 500
"""Messages of reference and estimators, estimators in each, and pairs a second."""
GROWTH = 3.0
"""Memory that the second half may add [MB]."""
FIRST_STAMP = 1_700_000_000_000_000_000
REFERENCE, COMPARED = "reference/joint_states", "tilt/compare"


def rows(effort: Effort) -> Iterator[Row]:
    """Feed it, and look at the memory of this process."""
    with opened_graph() as graph:
        node = graph.add(EvaluatorNode(**graph.options(table=False, estimators=[""])))
        pairs, memory = effort.tries(MESSAGES) // 2, 0.0
        feed = Feed(graph)
        for index in range(pairs):
            feed.pair(index)
            if index % RATE == 0:
                node.publish_figures()
            if index % (60 * RATE) == 0:  # its timer, in the time of the stamps
                give_back()
            if not memory and 2 * index >= pairs:
                memory = resident_megabytes()
        give_back()
        grown, failed = resident_megabytes() - memory, callback_errors([node])
        lost = 2 * pairs - node._received
    minutes = pairs / RATE / 60.0
    yield Row(
        f"{ESTIMATORS} estimators at {RATE} Hz for {minutes:.1f} min of their stamps",
        2 * pairs,
        f"no error, no message lost, below {GROWTH:g} MB in the second half",
        f"{failed} errors; {lost} lost; {grown:+.1f} MB",
        failed == lost == 0 and grown < GROWTH,
    )


class Feed:
    """Publishes a reference and what is compared with it."""

    def __init__(self, graph: Graph) -> None:
        """Wait for who listens."""
        self._graph = graph
        names = tuple(f"estimator_{index}" for index in range(ESTIMATORS))
        self._encoders = JointStateEncoder(("tilt",)), JointStateEncoder(names)
        create = graph.probe.create_publisher
        self._publishers: list[Any] = [
            create(JointState, topic, 100) for topic in (REFERENCE, COMPARED)
        ]
        graph.spin_until(lambda: all(e.get_subscription_count() for e in self._publishers))

    def pair(self, index: int) -> None:
        """Publish one reference and one set of estimates; let the node take them."""
        stamp = FIRST_STAMP + index * 10**9 // RATE
        tilt = 0.1 * math.sin(stamp * 1e-9)
        for publisher, encoder, count in zip(
            self._publishers, self._encoders, (1, ESTIMATORS), strict=True
        ):
            publisher.publish(encoder.encode(stamp, [tilt] * count, [0.0] * count))
        for _ in range(4):
            self._graph.executor.spin_once(timeout_sec=0.0)
