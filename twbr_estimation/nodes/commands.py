"""The nodes as commands: `filter_node` of this module is what the command `filter_node` calls.

A command prepares its process before it imports its node and with it numpy. Importing a node does
not: the process may be a user's own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module

from ..starting import start_node


def __getattr__(name: str) -> Callable[[], int]:
    """Return the command of the node of this name."""
    if not name.endswith("_node"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return partial(_run, name)


def _run(name: str) -> int:
    start_node()
    status: int = import_module(f"{__package__}.{name}").main()
    return status
