"""Nodes in this process: created, called directly, spun, and asked what they published."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message

from twbr_estimation.nodes.spin import make_executor


class Graph:
    """A context with a probe and any number of nodes."""

    def __init__(self, domain: int | None = None) -> None:
        """Start in a ROS domain; None is that of the environment."""
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.executor = make_executor(self.context)
        self.nodes: list[Any] = []
        self.probe = self.add(rclpy.create_node("probe", context=self.context))
        """A plain node to subscribe, publish and call services with."""

    def add(self, node: Any) -> Any:
        """Spin this node, created with `**graph.options()`, too."""
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def options(self, **parameters: Any) -> dict[str, Any]:
        """Return node options with initial parameters (`a__b` is `a.b`)."""
        given = [Parameter(key.replace("__", "."), value=v) for key, v in parameters.items()]
        return {"context": self.context, "parameter_overrides": given}

    def spin_until(self, condition: Callable[[], bool], limit: float = 60.0) -> None:
        """Spin until the condition holds.

        Raises:
            TimeoutError: it does not within `limit` [s].
        """
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"condition not met within {limit:g} s")
            self.executor.spin_once(timeout_sec=0.01)

    def call(self, kind: Any, service: str, request: Any) -> Any:
        """Call a service and return its response."""
        client = self.probe.create_client(kind, service)
        self.spin_until(client.service_is_ready)
        future = client.call_async(request)
        self.spin_until(future.done)
        self.probe.destroy_client(client)
        return future.result()

    def close(self) -> None:
        """Destroy all nodes and the context."""
        for node in self.nodes:
            self.executor.remove_node(node)
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()


@contextmanager
def opened_graph() -> Iterator[Graph]:
    """Yield a graph; close it afterwards."""
    graph = Graph()
    try:
        yield graph
    finally:
        graph.close()


class Wiretap:
    """Calls the nodes' subscriptions with serialised messages, without the middleware's losses."""

    def __init__(self, *nodes: Any) -> None:
        """Find the subscriptions of these nodes."""
        self.delivered = 0
        """Calls of callbacks."""
        self.raised: Counter[str] = Counter()
        """What callbacks without a guard raised; each would have ended its node."""
        self._takers: dict[str, list[tuple[Callable[[Any], object], bool]]] = {}
        for node in nodes:
            for each in node.subscriptions:
                own = node.get_namespace().rstrip("/")
                self.listen(each.topic_name.removeprefix(own), each.callback, each.raw)

    def listen(self, topic: str, take: Callable[[Any], object], raw: bool) -> None:
        """Deliver the messages of a topic to `take`, too; serialised where `raw`."""
        self._takers.setdefault(f"/{topic.lstrip('/')}", []).append((take, raw))

    def send(self, topic: str, message: Any, spoil: Callable[[bytes], bytes] = bytes) -> None:
        """Deliver a message to all who subscribed to its topic.

        Args:
            topic: Without a namespace; who subscribed to it in one gets it as well.
            message: What is sent.
            spoil: Changes the serialised message; who takes it deserialised gets it unchanged.
        """
        takers = self._takers.get(f"/{topic.lstrip('/')}", ())
        if not takers:
            return
        data = spoil(serialize_message(message))
        for take, raw in takers:
            self.guarded(topic, partial(take, data if raw else message))
            self.delivered += 1

    def guarded(self, what: str, call: Callable[[], object]) -> None:
        """Call it, and count what it raises."""
        try:
            call()
        except Exception as error:
            self.raised[f"{what}: {error!r}"] += 1


def taped(publisher: Any, take: Callable[[Any], object]) -> None:
    """Show `take` what a publisher sends, too."""
    publish = publisher.publish

    def both(message: Any) -> None:
        take(message)
        publish(message)

    publisher.publish = both


class Numbers:
    """Counts what is published, and what of it is no finite number."""

    def __init__(self, decode: Callable[[Any], float]) -> None:
        """`decode`: returns a sum of all numbers in a serialised message."""
        self._decode = decode
        self.counts: Counter[str] = Counter()

    def __call__(self, message: Any) -> None:
        """Take a message."""
        self.counts["published"] += 1
        self.counts["not finite"] += not math.isfinite(self._decode(message))


def callback_errors(nodes: list[Any]) -> int:
    """Return how often callbacks of these nodes raised what nobody expected."""
    return sum(node.callback_errors.defects for node in nodes if hasattr(node, "callback_errors"))


def error_lines(nodes: list[Any]) -> list[tuple[str, int]]:
    """Return what callbacks of these nodes raised, with its count."""
    return [
        (f"{node.get_name()}: {what}", times)
        for node in nodes
        if hasattr(node, "callback_errors")
        for what, times in node.callback_errors.counts.items()
    ]


def resident_megabytes() -> float:
    """Return the memory that this process occupies [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
