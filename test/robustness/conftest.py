"""The fixtures of the nodes' tests, for tests that try to break them."""

from __future__ import annotations

from nodes.conftest import domain, graph, python

__all__ = ["domain", "graph", "python"]
