"""Ends and deadlocks of a controller's own process, and what its client receives then."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NamedTuple

from reliability.fed_controller import FedController
from reliability.motor_causes import HOLD, Controller, controller

_CHANGED = """
import sys, threading
from twbr_estimation.nodes import controller_node

class Changed(controller_node.ControllerNode):
    def _on_joints(self, data):
        if self._stream.counts["steps"] > 200:
            {does}
        super()._on_joints(data)

controller_node.ControllerNode = Changed
sys.exit(controller_node.main())
"""
DEADLOCK = _CHANGED.format(does="lock = threading.Lock(); lock.acquire(); lock.acquire()")
"""A callback that waits for what never comes."""
TALKATIVE = _CHANGED.format(does="self.get_logger().warning('x' * 1000)")
"""A callback that logs at every message."""
NO_SPACE = (
    "unshare", "-rm", "sh", "-c",
    "mount -t tmpfs -o size=16k tmpfs /mnt && export ROS_LOG_DIR=/mnt TMPDIR=/mnt && "
    "head -c 100k /dev/zero > /mnt/full 2>/dev/null; exec \"$0\" \"$@\"",
)  # fmt: skip
"""A command that starts a program whose folder for logs has no space."""


class End(NamedTuple):
    """What the client saw of an end."""

    driving: int
    """Commands that drive and came after the process had ended or was stuck."""
    zeros: int
    """Commands of zeros from the cause on."""
    last_drives: bool
    """Whether the last command of all drives."""
    status: int | None
    """Exit status of the process; None where it still runs."""


def can_mount() -> bool:
    """Return whether this user may have a file system of his own."""
    if shutil.which("unshare") is None:
        return False
    tried = subprocess.run([*NO_SPACE, "true"], capture_output=True, check=False)
    return tried.returncode == 0


def ended(graph: Any, number: signal.Signals, times: int = 1) -> End:
    """Send a signal to a controller that drives."""

    def end(made: Any) -> None:
        for _ in range(times):
            with suppress(ProcessLookupError):
                made.process.send_signal(number)

    return _observed(graph, end)


def terminal_gone(graph: Any) -> End:
    """Close the terminal that a controller runs on."""
    ours, its = os.openpty()
    try:
        return _observed(graph, lambda made: os.close(ours), terminal=its)
    finally:
        os.close(its)


def _observed(graph: Any, end: Callable[[Any], None], **options: Any) -> End:
    with controller(graph, **options) as made:
        robot = made.robot
        robot.until(robot.drives)
        first = len(robot.commands)
        end(made)
        robot.until(lambda: made.process.poll() is not None)
        robot.wait(0.1)
        gone = len(robot.commands)
        robot.until(_passed(HOLD))
        later = [each for _, each, _ in robot.commands[first:]]
        return End(
            robot.driving(gone),
            sum(not any(each) for each in later),
            robot.drives(),
            made.process.returncode,
        )


def stuck(graph: Any) -> End:
    """Run a controller that gets stuck in a callback while it is fed."""
    with controller(graph, program=DEADLOCK) as made:
        robot = made.robot
        robot.until(lambda: _zeros_for(robot, HOLD), 60.0)
        first = len(robot.commands)
        robot.until(_passed(2.0 * HOLD))
        later, driving = len(robot.commands) - first, robot.driving(first)
        return End(driving, later - driving, robot.drives(), made.process.poll())


@contextmanager
def unread(graph: Any) -> Iterator[Controller]:
    """Yield a controller that logs at every message, to a terminal that takes no output."""
    ours, its = os.openpty()
    try:
        with controller(graph, program=TALKATIVE, terminal=its) as made:
            fed = made.robot.count
            made.robot.until(lambda: made.robot.count > fed + 400)
            yield made
    finally:
        os.close(ours)
        os.close(its)


def _zeros_for(robot: FedController, seconds: float) -> bool:
    """Return whether no command has driven for so long; a late tilt cuts for a moment, too."""
    driven = [at for at, each, _ in robot.commands if any(each)]
    return bool(driven) and time.monotonic() - driven[-1] > seconds


def _passed(seconds: float) -> Callable[[], bool]:
    end = time.monotonic() + seconds
    return lambda: time.monotonic() > end
