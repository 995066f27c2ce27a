"""The state of a robot in words, from the diagnostics of its nodes."""

from __future__ import annotations

from collections.abc import Sequence

from .source import Status, StreamRate

RANK = ("OK", "STALE", "WARN", "ERROR")
"""Levels, the worst last."""
SILENT_AFTER = 3.0
"""Age of its diagnostics from which on a node is taken for lost [s]; they come once a second."""
CONTROLLER, FILTER = "controller_node", "filter_node"
LOST = ("lost", "unreadable", "dropped", "missed", "not_finite", "timeouts")
"""What the names of counters have in them that count losses."""


def name_within(space: str, full_name: str) -> str | None:
    """Return what diagnostics are called within a namespace; None for those of another one.

    Args:
        space: Namespace of a robot; "" for the root, in which that of another robot may lie.
        full_name: Node with its namespace; ": part" may follow, whose slashes do not count.
    """
    node, colon, part = full_name.lstrip("/").partition(":")
    where, _, name = node.rpartition("/")
    return f"{name}{colon}{part}" if where == space.strip("/") else None


def state_in_words(statuses: Sequence[Status], silent: bool, valid: bool | None) -> tuple[str, str]:
    """Return one line about the robot, and its level.

    Args:
        statuses: The latest of each node.
        silent: Whether no tilt arrives.
        valid: Last value of `tilt/valid`; None before the first.
    """
    lost = [each.name for each in statuses if each.age > SILENT_AFTER]
    gone = [f"{', '.join(lost)} silent"] if lost else []
    if silent:
        return "; ".join(["stale: no tilt arrives", *gone]), "STALE"
    by_name = {each.name: each for each in statuses if each.name not in lost}
    shown = [by_name[name] for name in (CONTROLLER, FILTER) if name in by_name]
    shown = [each for each in shown if each.name == CONTROLLER or each.level != "OK"]
    parts = [each.message for each in shown] or ["estimating"]
    level = max((each.level for each in shown), key=RANK.index, default="OK")
    if gone:
        level = max(level, "WARN", key=RANK.index)
    if valid is False:
        parts.append("tilt not valid")
        level = "ERROR"
    return "; ".join([*gone, *parts]), level


def losses(
    statuses: Sequence[Status], rates: Sequence[StreamRate] = (), not_finite: int = 0
) -> list[str]:
    """Return every counter of losses that is not zero, as `node: counter value`.

    Args:
        statuses: The latest of each node.
        rates: How the topics arrive at the page.
        not_finite: Samples that the page cannot draw.
    """
    here = [f"{each.topic}: unreadable {each.unreadable}" for each in rates if each.unreadable]
    if not_finite:
        here.append(f"page: not_finite {not_finite}")
    of_nodes = [
        f"{each.name}: {name} {value}"
        for each in sorted(statuses, key=lambda each: each.name)
        for name, value in each.values.items()
        if any(word in name for word in LOST) and value.strip() not in ("", "0")
    ]
    return of_nodes + here
