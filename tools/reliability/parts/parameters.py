"""Random parameter requests."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Iterator
from typing import Any

from rclpy.parameter import Parameter

from reliability.all_nodes import drivers, serial_line, subscribers
from reliability.graph import callback_errors, error_lines, opened_graph, resident_megabytes
from reliability.parts.messages import GROWTH
from reliability.row import Effort, Row
from twbr_estimation.nodes.memory import give_back

CALLS = 100_000
VALUES: tuple[Any, ...] = (
    True, 0, -1, 2**62, 0.0, -1.0, 1e308, math.nan, math.inf, "", "all", "kalman", "x" * 1000,
    [], [0.1], [0.1, 0.2], [0.1] * 3, [math.nan] * 3, [1e300] * 3, [1] * 3, [True], ["a"], [""],
)  # fmt: skip
LEFT_ALONE = ("use_sim_time", "json_file", "calibration_file")
"""Parameters that are of rclpy, or whose files no random name should write."""


def rows(effort: Effort) -> Iterator[Row]:
    """Set parameters of every node; what is refused must have changed nothing."""
    with opened_graph() as graph, serial_line() as (_, port):
        nodes = [*subscribers(graph), *drivers(graph, port)]
        draw, memory = random.Random(effort.seed), 0.0
        counts: Counter[str] = Counter()
        count = effort.tries(CALLS)
        names = {node: _names(node) for node in nodes}
        for index in range(count):
            request(draw, draw.choice(nodes), names, counts)
            if 2 * index >= count and not memory:
                give_back()
                memory = resident_megabytes()
        give_back()
        grown, failed = resident_megabytes() - memory, callback_errors(nodes)
        for what, times in error_lines(nodes):
            print(f"  {times} times: {what}", flush=True)
    seen = (
        f"{counts['accepted']} values accepted, {counts['refused']} refused; {failed} errors; "
        f"{counts['half applied']} half applied; {counts['without reason']} without a reason; "
        f"{counts['not finite']} not finite; {grown:+.1f} MB"
    )
    wrong = counts["half applied"] + counts["without reason"] + counts["not finite"] + failed
    promised = "no end, no error, refused with a reason and without effect, no growth"
    yield Row(
        f"random parameters of {len(nodes)} nodes",
        count,
        promised,
        seen,
        not wrong and grown < GROWTH,
    )


def _names(node: Any) -> list[str]:
    declared = node.list_parameters([], 0).names
    return [*(each for each in declared if each not in LEFT_ALONE), "", "unknown", "robot."]


def request(
    draw: random.Random, node: Any, names: dict[Any, list[str]], counts: Counter[str]
) -> None:
    """Set one to three parameters of a node together, and look at what became of them."""
    chosen = {
        name: _drawn(draw, node, name) for name in draw.choices(names[node], k=draw.randint(1, 3))
    }
    before = {name: _value(node, name) for name in chosen}
    result = node.set_parameters_atomically(list(chosen.values()))
    counts["accepted" if result.successful else "refused"] += len(chosen)
    counts["without reason"] += not (result.successful or result.reason)
    for name, value in before.items():
        now = _value(node, name)
        counts["half applied"] += not result.successful and now != value
        counts["not finite"] += isinstance(now, float) and not math.isfinite(now)


def _drawn(draw: random.Random, node: Any, name: str) -> Parameter:
    """Return a wild value, or one near that in force."""
    value = _value(node, name)
    if isinstance(value, float) and draw.random() < 0.4:
        return Parameter(name, value=value * draw.uniform(0.9, 1.1))
    if draw.random() < 0.05:
        return Parameter(name, Parameter.Type.NOT_SET)
    return Parameter(name, value=draw.choice(VALUES))


def _value(node: Any, name: str) -> Any:
    if not node.has_parameter(name):
        return None
    value = node.get_parameter(name).value
    return value if isinstance(value, (bool, int, float, str, type(None))) else list(value)
