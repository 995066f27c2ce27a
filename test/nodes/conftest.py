"""Fixtures for tests of real nodes: a ROS domain of their own, and a graph that is spun.

Tests count messages and wait for conditions; the time limits only end a failing test.
"""

from __future__ import annotations

import fcntl
import os
import random
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")

HIGHEST_DOMAIN = 101
"""The last domain whose UDP ports lie below Linux's ephemeral ports."""


def _unused(domain: int) -> bool:
    """Whether no participant of any program holds the domain's discovery port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7400 + 250 * domain))
        except OSError:
            return False
    return True


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Reserve an unused ROS domain; also set in the environment for child processes."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    for candidate in random.sample(range(1, HIGHEST_DOMAIN + 1), HIGHEST_DOMAIN):
        with (Path(tempfile.gettempdir()) / f"ros_domain_{candidate}.lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            if _unused(candidate):
                monkeypatch.setenv("ROS_DOMAIN_ID", str(candidate))
                yield candidate
                return
    pytest.fail(f"all {HIGHEST_DOMAIN} ROS domains are in use")


class Graph:
    """Nodes of one test in one context, spun by one executor in the test's thread."""

    def __init__(self, domain: int) -> None:
        from rclpy.context import Context

        from twbr_estimation.nodes.spin import make_executor

        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.executor = make_executor(self.context)
        self.nodes: list[Any] = []
        self.probe = self.add(rclpy.create_node("probe", context=self.context))
        """A plain node to subscribe, publish and call services with."""

    def add(self, node: Any) -> Any:
        """Spin this node too; it must have been created with `**graph.options(...)`."""
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def options(self, **parameters: Any) -> dict[str, Any]:
        """Return node options with this context and initial parameters (`a__b` is `a.b`)."""
        from rclpy.parameter import Parameter

        overrides = [Parameter(key.replace("__", "."), value=v) for key, v in parameters.items()]
        return {"context": self.context, "parameter_overrides": overrides}

    def collect(self, kind: Any, topic: str, depth: int = 1000) -> list[Any]:
        """Subscribe reliably; the list grows as messages arrive."""
        received: list[Any] = []
        self.probe.create_subscription(kind, topic, received.append, depth)
        return received

    def spin_until(self, condition: Callable[[], bool], limit: float = 20.0) -> None:
        """Spin until the condition holds; fail after `limit` seconds."""
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                pytest.fail(f"condition not met within {limit} s")
            self.executor.spin_once(timeout_sec=0.02)

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


@pytest.fixture
def graph(domain: int) -> Iterator[Graph]:
    """Yield an empty graph in a domain of its own."""
    created = Graph(domain)
    yield created
    created.close()


@pytest.fixture
def python() -> str:
    """Return the interpreter for child processes that run nodes."""
    os.environ.setdefault("PYTHONUNBUFFERED", "1")
    return sys.executable
