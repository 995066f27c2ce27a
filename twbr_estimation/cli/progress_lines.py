"""Progress of several things at once, a line each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from ..tuning.tune import Report

Line = Callable[[str, str], None]
"""Shows what is being worked on and how far it is, a line each."""


@contextmanager
def lines(console: Console) -> Iterator[Line]:
    """Show a line for everything that is being worked on."""
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        tasks: dict[str, Any] = {}

        def line(name: str, text: str) -> None:
            if name not in tasks:
                tasks[name] = progress.add_task("", total=None)
            progress.update(tasks[name], description=escape(f"{name}: {text}"))

        yield line


def best_so_far(line: Line, name: str, best: float) -> None:
    """Show the best figure so far of what is being tuned."""
    line(name, f"best so far {best:.4g} deg²")


@contextmanager
def shown(console: Console) -> Iterator[Report]:
    """Show the best figure so far of everything that is being tuned."""
    with lines(console) as line:
        yield partial(best_so_far, line)
