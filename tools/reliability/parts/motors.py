"""Motors that have to stop.

A controller that drives is fed by hand, and so is a whole robot whose nodes are killed and stopped.
An independent client counts the commands: after each cause they are zeros, and stay so until the
robot has been stood up.
"""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from reliability.graph import opened_graph
from reliability.live_robot import live_robot
from reliability.motor_causes import (
    LIMIT,
    RETURN,
    Cause,
    Controller,
    Outcome,
    clocks_set,
    controller,
    tilts_at_fault,
    tried,
)
from reliability.motor_ends import NO_SPACE, End, can_mount, ended, stuck, terminal_gone, unread
from reliability.row import Effort, Row
from reliability.set_clock import SetClock, compiler

CAUSES, ENDS, NODES = 20, 5, 5
"""Tries of each cause, of each end and of each node."""
SEEN_LATE = 0.02
"""What the client may add to a time [s]: it looks every 5 ms, and shares the processor."""
ALLOWED = f" (+{SEEN_LATE:g} s until the client sees them)"
FIRST_ZEROS = 11
"""Commands in `tilt_timeout` and one `period`."""
UPSTREAM = ("simulator_node", "correction_node", "filter_node")


def rows(effort: Effort) -> Iterator[Row]:
    """Try all causes, all ends, and all nodes upstream."""
    with suppress(PermissionError):  # the times are those of a robot without other work
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    yield from _of_causes(effort)
    yield from _of_surroundings(effort)
    yield from _of_ends(effort)
    yield from _of_nodes(effort)


def _of_causes(effort: Effort) -> Iterator[Row]:
    with opened_graph() as graph, TemporaryDirectory(prefix="twbr_clock_") as folder:
        clock = SetClock(Path(folder)) if compiler() else None
        with controller(graph, clock=clock) as made:
            for cause in tilts_at_fault() + (clocks_set() if clock else []):
                yield _row(made, cause, effort)


def _of_surroundings(effort: Effort) -> Iterator[Row]:
    """Try the silence of a simulated clock, a terminal that is not read, and a full disk."""
    with opened_graph() as graph:
        simulated = ("-p", "use_sim_time:=true")
        with controller(graph, arguments=simulated) as made:
            yield _row(made, Cause("/clock and tilt fall silent, use_sim_time"), effort)
    with opened_graph() as graph, unread(graph) as made:
        yield _row(made, Cause("no tilt comes, terminal takes no output"), effort)
    if can_mount():
        with opened_graph() as graph, controller(graph, command=NO_SPACE) as made:
            yield _row(made, Cause("no tilt comes, disk of the logs full"), effort)


def _row(made: Controller, cause: Cause, effort: Effort) -> Row:
    found = [tried(made, cause) for _ in range(effort.tries(CAUSES))]
    early = sum(each.early for each in found)
    back = max(each.back for each in found)
    stops = sorted(each.stopped for each in found)
    fine = early == 0 and back <= RETURN
    if cause.answers:
        fine &= stops[-1] <= cause.limit + SEEN_LATE
        stopped = f"zeros after {median(stops):.3f} s, at most {stops[-1]:.3f} s"
        promised = f"zeros within {cause.limit:g} s{ALLOWED}"
    else:
        stopped, promised = f"{_commands(found)} commands meanwhile", "nothing meanwhile"
        fine &= _commands(found) == 0
    return Row(
        cause.name,
        len(found),
        f"{promised}, none that drives before the robot is stood up, balanced {RETURN:g} s after",
        f"{stopped}; {early} that drive too early; driven {back:.2f} s after it is stood up",
        fine,
    )


def _commands(found: list[Outcome]) -> int:
    return sum(each.driving + each.zeros for each in found)


def _of_ends(effort: Effort) -> Iterator[Row]:
    ends: dict[str, Callable[[Any], End]] = {
        "SIGINT to the controller": lambda graph: ended(graph, signal.SIGINT),
        "SIGTERM to the controller": lambda graph: ended(graph, signal.SIGTERM),
        "SIGHUP to the controller, twice": lambda graph: ended(graph, signal.SIGHUP, 2),
        "the controller's terminal is gone": terminal_gone,
        "a callback that never returns": stuck,
    }
    for name, end in ends.items():
        found = []
        for _ in range(effort.tries(ENDS)):
            with opened_graph() as graph:
                found.append(end(graph))
        driving = sum(each.driving for each in found)
        zeros = min(each.zeros for each in found)
        statuses = {each.status for each in found}
        yield Row(
            name,
            len(found),
            "zeros are the last command; an end has the status 0",
            f"{driving} that drive afterwards, at least {zeros} of zeros; status {statuses}",
            driving == 0
            and zeros > 0
            and statuses <= {0, None}
            and not any(each.last_drives for each in found),
        )


def _of_nodes(effort: Effort) -> Iterator[Row]:
    with opened_graph() as graph, live_robot(graph) as robot:
        for node in UPSTREAM:
            for number in (signal.SIGKILL, signal.SIGSTOP):
                seen = []
                for _ in range(effort.tries(NODES)):
                    outcome = robot.silenced(node, number)
                    seen.append((outcome, *robot.recovered(node, number)))
                driving = max(each.driving for each, *_ in seen)
                zero = sorted(each.first_zero for each, *_ in seen)
                early, stood = sum(each[1] for each in seen), max(each[2] for each in seen)
                yield Row(
                    f"{number.name} to {node} of a robot that balances",
                    len(seen),
                    f"at most {FIRST_ZEROS} commands that drive after the last tilt, zeros within "
                    f"{LIMIT:g} s{ALLOWED}, none before it is stood up",
                    f"at most {driving}; zeros after {median(zero):.3f} s, at most {zero[-1]:.3f} "
                    f"s; {early} that drive too early; stood up at most {stood} times",
                    driving <= FIRST_ZEROS
                    and early == 0
                    and zero[-1] <= LIMIT + SEEN_LATE
                    and math.isfinite(zero[-1]),
                )
