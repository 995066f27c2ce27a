"""Random lifecycle transitions."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from typing import Any

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState

from reliability.all_nodes import drivers, serial_line
from reliability.graph import callback_errors, opened_graph, resident_megabytes
from reliability.parts.messages import GROWTH
from reliability.row import Effort, Row
from twbr_estimation.nodes.controller_node import ControllerNode

TRANSITIONS = 10_000
DRAWN = (
    *(Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP) * 4,
    *(Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE) * 4,
    *(Transition.TRANSITION_CREATE, Transition.TRANSITION_DESTROY, 60, 99, 255),
)
"""Possible and impossible ones; those that end a node for good are not among them."""


def rows(effort: Effort) -> Iterator[Row]:
    """Ask nodes with a lifecycle for anything; at the end they must work again."""
    with opened_graph() as graph, serial_line() as (_, port):
        made = graph.add(ControllerNode(**graph.options(autostart=False, prepare_all=False)))
        nodes, draw, memory = [*drivers(graph, port), made], random.Random(effort.seed), 0.0
        counts: Counter[str] = Counter()
        count = effort.tries(TRANSITIONS)
        for index in range(count):
            node = draw.choice(nodes)
            answered = change(node, draw.choice(DRAWN))
            counts["made" if answered else "answered False"] += 1
            graph.executor.spin_once(timeout_sec=0.0)
            if 2 * index >= count and not memory:
                memory = resident_megabytes()
        grown, failed = resident_megabytes() - memory, callback_errors(nodes)
        active = sum(map(brought_to_work, nodes))
    seen = (
        f"{counts['made']} made, {counts['answered False']} answered False; {failed} errors; "
        f"{active} of {len(nodes)} active at the end; {grown:+.1f} MB"
    )
    promised = "no end, no error, all active again, no growth"
    fine = failed == 0 and active == len(nodes) and grown < GROWTH
    yield Row("random transitions of drivers and controller", count, promised, seen, fine)


def change(node: Any, transition: int) -> bool:
    """Ask for a transition as the service does; return its answer."""
    request, response = ChangeState.Request(), ChangeState.Response()
    request.transition.id = transition
    answer = node._LifecycleNodeMixin__on_change_state(request, response)
    return bool(answer.success)


def brought_to_work(node: Any) -> bool:
    """Configure and activate a node from whatever state it is in."""
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        change(node, transition)
    return bool(node._state_machine.current_state[0] == State.PRIMARY_STATE_ACTIVE)
