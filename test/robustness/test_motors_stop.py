"""Every cause stops the motors: processes as a robot has them, checked by a client of its own."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: pip install .[ros]")
from reliability.motor_causes import (
    RETURN,
    Cause,
    Controller,
    Outcome,
    clocks_set,
    controller,
    tilts_at_fault,
    tried,
)
from reliability.motor_ends import (
    NO_SPACE,
    can_mount,
    ended,
    stuck,
    terminal_gone,
    unread,
)
from reliability.set_clock import SetClock, compiler

SLACK = 0.5
"""For a loaded machine [s]; counted commands say what time cannot."""


@pytest.fixture
def folder() -> Iterator[Path]:
    with TemporaryDirectory() as made:
        yield Path(made)


def held(cause: Cause, seen: Outcome) -> None:
    """Assert that the motors stopped and stayed off until the robot was stood up."""
    assert seen.early == 0, f"{cause.name}: driven before it was stood up: {seen}"
    if cause.answers:
        assert seen.zeros > 0 and seen.stopped < cause.limit + SLACK, f"{cause.name}: {seen}"
    else:
        assert seen.driving == seen.zeros == 0, f"{cause.name}: {seen}"
    assert seen.back < RETURN + 20.0 * SLACK, f"{cause.name}: {seen}"


def test_every_fault_of_the_tilt_stops_them_until_the_robot_is_stood_up(graph: Any) -> None:
    with controller(graph) as made:
        for cause in tilts_at_fault():
            held(cause, tried(made, cause))


@pytest.mark.skipif(compiler() is None, reason="needs a C compiler, to set a clock")
def test_a_clock_that_is_set_stops_them(graph: Any, folder: Path) -> None:
    with controller(graph, clock=SetClock(folder)) as made:
        for cause in clocks_set():
            held(cause, tried(made, cause))


@pytest.mark.parametrize(
    ("number", "times"), [(signal.SIGINT, 1), (signal.SIGTERM, 1), (signal.SIGHUP, 2)]
)
def test_a_signal_stops_them_before_the_node_ends(
    graph: Any, number: signal.Signals, times: int
) -> None:
    seen = ended(graph, number, times)
    assert seen.status == 0 and seen.driving == 0 and not seen.last_drives and seen.zeros > 0


def test_a_terminal_that_is_closed_stops_them(graph: Any) -> None:
    seen = terminal_gone(graph)
    assert seen.status == 0 and seen.driving == 0 and not seen.last_drives and seen.zeros > 0


def test_a_callback_that_never_returns_stops_them(graph: Any) -> None:
    seen = stuck(graph)
    assert seen.status is None and seen.driving == 0
    assert seen.zeros >= 2, "zeros are repeated"


def test_a_terminal_that_takes_no_output_stops_nothing_but_what_it_must(graph: Any) -> None:
    with unread(graph) as made:
        cause = tilts_at_fault()[0]
        held(cause, tried(made, cause))


def test_a_simulated_clock_that_falls_silent_stops_them(graph: Any) -> None:
    with controller(graph, arguments=("-p", "use_sim_time:=true")) as made:
        cause = tilts_at_fault()[0]
        held(cause, tried(made, cause))


def test_without_a_clock_nothing_moves(graph: Any) -> None:
    made = Controller(graph, arguments=("-p", "use_sim_time:=true"), simulated_time=False)
    try:
        made.robot.until(lambda: len(made.robot.commands) > 200, 60.0)
        assert not any(any(each) for _, each, _ in made.robot.commands)
    finally:
        made.close()


@pytest.mark.skipif(not can_mount(), reason="needs `unshare` with a file system of its own")
def test_a_full_disk_changes_nothing(graph: Any) -> None:
    with controller(graph, command=NO_SPACE) as made:
        cause = tilts_at_fault()[0]
        held(cause, tried(made, cause))
